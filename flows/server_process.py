"""The process of a Prefect server on 127.0.0.1: ``python -m pitchlore.flows.server_process PORT TOKEN``.

The process binds its port first, so that no other process can take it, and writes it to standard output.
It writes `ready` when it answers. Each answer has its token, which tells it from any other server at its
port. It ends when its standard input ends, that is with the process that started it, however that process
ends. If it reads a line before, it stays.
"""

from __future__ import annotations

import os
import socket
import sys
from threading import Thread

from pitchlore.pipeline.engine.child import collect_rarely

#: Exit code if another process listens on the port.
TAKEN = 4
#: The header of each answer that has the token.
HEADER = "x-pitchlore-server"


def main(port: int, token: str) -> None:
    """Serve until told to stop; port 0 is any free one."""
    collect_rarely()
    try:
        listener = socket.create_server(("127.0.0.1", port))
    except OSError:
        sys.exit(TAKEN)
    # connections inherit it; asyncio sets it on sockets that name their protocol, which this one does not
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    port = listener.getsockname()[1]
    Thread(target=_end_with_input, daemon=True).start()
    _say(str(port))
    os.environ["PREFECT_UI_API_URL"] = f"http://127.0.0.1:{port}/api"
    import uvicorn  # noqa: PLC0415 (the port is taken before what takes seconds is loaded)

    class Server(uvicorn.Server):
        """A server that says when it is ready."""

        async def startup(self, sockets: list[socket.socket] | None = None) -> None:
            await super().startup(sockets)
            if self.started:
                _say("ready")
                os.dup2(2, 1)  # nobody reads on

    Server(uvicorn.Config(
        "prefect.server.api.server:create_app", factory=True, log_level="error", lifespan="on",
        timeout_graceful_shutdown=1, headers=[(HEADER, token)],
    )).run(sockets=[listener])


def _say(word: str) -> None:
    os.write(1, f"{word}\n".encode())


def _end_with_input() -> None:
    """End the process when standard input ends. The database survives this at any moment."""
    if not os.read(0, 64):
        os._exit(0)


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2])
