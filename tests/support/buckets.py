"""A bucket on this machine: moto's S3, and in front of it a proxy that fails as a network does."""

import logging
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, nullcontext
from functools import cached_property
from http.client import HTTPConnection, HTTPResponse
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from itertools import count
from pathlib import Path

import boto3
from moto.core import DEFAULT_ACCOUNT_ID
from moto.s3.models import s3_backends
from moto.server import ThreadedMotoServer

#: What the tests' credentials are; nothing may repeat them.
CREDENTIALS = {"AWS_ACCESS_KEY_ID": "AKIATESTKEYOFPITCHLORE", "AWS_SECRET_ACCESS_KEY": "secret-of-the-tests"}
NAME = "league"
_numbers = count(1)

#: Answers of a bucket that is busy, and of one that is broken; no answer, before and after the work was done;
#: and one that comes too late.
FAULTS = ("503", "500", "cut before", "cut after", "late")
#: How late, seconds: later than any patience of the tests.
LATE_S = 1.5


class Served:
    """A server of buckets.

    Attributes:
        fault: called with the number of each request, counted from 1; the fault that it meets, or None.
        asked: number of requests since :meth:`mend`.
    """

    def __init__(self) -> None:
        logging.getLogger("werkzeug").setLevel(logging.CRITICAL)
        self._moto = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
        self._moto.start()
        self._behind = self._moto.get_host_and_port()
        self.fault: Callable[[int], str | None] = lambda _: None
        self.asked = 0
        self._lock, self._turn = threading.Lock(), threading.Lock()
        self._proxy = ThreadingHTTPServer(("127.0.0.1", 0), type("Handler", (_Handler,), {"served": self}))
        self._proxy.daemon_threads = True
        threading.Thread(target=self._proxy.serve_forever, daemon=True).start()
        self.client.create_bucket(Bucket=NAME)

    @cached_property
    def client(self):
        """A client of another library, which asks the server itself; one takes a tenth of a second to make."""
        host, port = self._behind
        return boto3.client("s3", endpoint_url=f"http://{host}:{port}", region_name="us-east-1",
                            aws_access_key_id="other", aws_secret_access_key="other")

    @property
    def environment(self) -> dict[str, str]:
        """Options that say how to reach it."""
        return {**CREDENTIALS, "AWS_REGION": "us-east-1",
                "AWS_ENDPOINT_URL": f"http://127.0.0.1:{self._proxy.server_port}"}

    def new(self) -> str:
        """The URL of an empty folder."""
        return f"s3://{NAME}/folder-{next(_numbers)}"

    def objects(self, url: str) -> dict[str, bytes]:
        """All objects under a URL, by key, as the server holds them."""
        prefix = url.removeprefix(f"s3://{NAME}/") + "/"
        held = s3_backends[DEFAULT_ACCOUNT_ID]["aws"].buckets[NAME].keys
        return {key.removeprefix(prefix): held[key].value for key in sorted(held) if key.startswith(prefix)}

    def put(self, url: str, key: str, data: bytes) -> None:
        """Write an object, without a request."""
        s3_backends[DEFAULT_ACCOUNT_ID]["aws"].put_object(NAME, f"{url.removeprefix(f's3://{NAME}/')}/{key}", data)

    def mend(self) -> None:
        """No more faults; count from 0."""
        self.fault, self.asked = lambda _: None, 0

    def meet(self) -> str | None:
        """The fault of the next request."""
        with self._lock:
            self.asked += 1
            return self.fault(self.asked)

    def ask(self, method: str, path: str, body: bytes, headers: dict[str, str]) -> tuple[HTTPResponse, bytes]:
        """The server's answer; writes under a condition are one after the other.

        Moto looks whether a key is there, and then writes it: of two threads at once both would succeed.
        """
        conditional = method == "PUT" and not {"if-match", "if-none-match"}.isdisjoint(map(str.lower, headers))
        connection = HTTPConnection(*self._behind, timeout=60)
        with self._turn if conditional else nullcontext(), closing(connection):
            connection.request(method, path, body, headers)
            answer = connection.getresponse()
            return answer, answer.read()

    def stop(self) -> None:
        self._proxy.shutdown()
        self._proxy.server_close()
        self._moto.stop()


class _Handler(BaseHTTPRequestHandler):
    """Passes requests on, unless there is a fault."""

    served: Served
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True

    def handle_any(self) -> None:
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        fault = self.served.meet()
        if fault in ("503", "500", "412", "200"):
            said = b"<html>Log in first</html>" if self.command != "HEAD" else b""
            self.send_response(int(fault))
            self.send_header("Content-Length", str(len(said)))
            self.send_header("ETag", "x")
            self.send_header("Last-Modified", "Sat, 28 Nov 2026 12:00:00 GMT")
            self.end_headers()
            self.wfile.write(said)
            return
        if fault == "late":
            time.sleep(LATE_S)
        if fault != "cut before":
            answer, data = self.served.ask(self.command, self.path, body, dict(self.headers))
        if fault is not None:
            self.close_connection = True
            return
        self.send_response(answer.status)
        for name, value in answer.getheaders():
            if name.lower() not in ("content-length", "connection", "transfer-encoding", "date", "server"):
                self.send_header(name, value)
        self.send_header("Content-Length", answer.getheader("Content-Length", "0") if self.command == "HEAD" else str(len(data)))
        self.end_headers()
        self.wfile.write(data)

    def __getattr__(self, name: str) -> Callable[[], None]:
        if name.startswith("do_"):
            return self.handle_any
        raise AttributeError(name)

    def log_message(self, *_: object) -> None:
        pass


@contextmanager
def served() -> Iterator[Served]:
    """A server of buckets, while the body runs."""
    server = Served()
    try:
        yield server
    finally:
        server.stop()


def files(folder: Path) -> dict[str, bytes]:
    """All files of a data folder that another one with the same matches has, too."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in sorted(folder.rglob("*"))
            if path.is_file() and not path.name.startswith(".") and path.suffix != ".duckdb"
            and path.parent.name != "runs"}
