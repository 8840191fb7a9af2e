"""A stand-in for Google's store of objects, as far as its XML interface is used: objects with generations."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import md5
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from itertools import count
from urllib.parse import parse_qs, unquote, urlsplit
from xml.sax.saxutils import escape

_WHEN, _WHEN_HTTP = "2026-11-02T10:00:00.000Z", "Mon, 02 Nov 2026 10:00:00 GMT"


class _Handler(BaseHTTPRequestHandler):
    """Puts under a condition on the generation; 0 is that of an object that is not there."""

    protocol_version = "HTTP/1.1"
    objects: dict[str, tuple[bytes, int]]
    numbers: Iterator[int]

    def do_PUT(self) -> None:
        key, data = self.key, self.rfile.read(int(self.headers["Content-Length"]))
        wanted = self.headers.get("x-goog-if-generation-match")
        if wanted is not None and int(wanted) != self.objects.get(key, (b"", 0))[1]:
            self.answer(412)
            return
        self.objects[key] = data, next(self.numbers)
        self.answer(200, b"", key)

    def do_GET(self) -> None:
        asked = parse_qs(urlsplit(self.path).query)
        if "list-type" in asked:
            (prefix,) = asked.get("prefix", [""])
            found = "".join(
                f"<Contents><Key>{escape(key)}</Key><Size>{len(data)}</Size><LastModified>{_WHEN}</LastModified>"
                f"<ETag>{tag(data)}</ETag></Contents>"
                for key, (data, _) in sorted(self.objects.items()) if key.startswith(prefix))
            self.answer(200, f"<ListBucketResult>{found}</ListBucketResult>".encode())
        elif self.key in self.objects:
            self.answer(200, self.objects[self.key][0], self.key)
        else:
            self.answer(404)

    def do_HEAD(self) -> None:
        self.do_GET()

    def do_DELETE(self) -> None:
        self.answer(204 if self.objects.pop(self.key, None) else 404)

    @property
    def key(self) -> str:
        return unquote(urlsplit(self.path).path).split("/", 2)[2]

    def answer(self, status: int, data: bytes = b"", key: str | None = None) -> None:
        self.send_response(status)
        self.send_header("Content-Length", str(len(data)))
        if key is not None:
            held, generation = self.objects[key]
            self.send_header("ETag", tag(held))
            self.send_header("x-goog-generation", str(generation))
            self.send_header("Last-Modified", _WHEN_HTTP)
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(data)

    def log_message(self, *_: object) -> None:
        pass


def tag(data: bytes) -> str:
    """The tag of an object, by its bytes."""
    return f'"{md5(data).hexdigest()}"'


@contextmanager
def google() -> Iterator[str]:
    """The address of a stand-in, while the body runs."""
    handler = type("Handler", (_Handler,), {"objects": {}, "numbers": count(1)})
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    server.daemon_threads = True
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        server.server_close()
