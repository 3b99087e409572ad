"""A substitute for the sidecar that Agones adds to a game server. It has the REST interface of the Agones SDK and the
states of a GameServer.
"""

import http.server
import json
import threading
import time

PATIENCE_S = 60


class Sidecar:
    """Simulates the sidecar. Usage: with Sidecar() as sidecar: … sidecar.port, sidecar.state, sidecar.calls"""

    def __init__(self, port=0, state="Scheduled"):
        self.calls = []   # list of (time, method, path)
        self.wrong = []   # invalid requests: those that an Agones client never sends
        self.state = state
        self.fails = 0    # number of next calls that are answered with status 500
        self._lock = threading.Lock()
        sidecar = self

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_POST(self):
                body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
                self._reply(sidecar.take("POST", self.path, body, self.headers.get("Content-Type")))

            def do_GET(self):
                self._reply(sidecar.take("GET", self.path, b"{}", "application/json"))

            def _reply(self, answer):
                status, value = answer
                text = json.dumps(value).encode()
                self.send_response(status)
                self.send_header("Content-Type", "application/json")
                self.send_header("Content-Length", str(len(text)))
                self.end_headers()
                self.wfile.write(text)

            def log_message(self, *_):
                pass

        self._server = http.server.ThreadingHTTPServer(("127.0.0.1", port), Handler)
        self.port = self._server.server_address[1]
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    def take(self, method, path, body, content_type):
        """Handles a POST request. Returns (status, answer)."""
        with self._lock:
            self.calls.append((time.monotonic(), method, path))
            if content_type != "application/json" or json.loads(body) != {}:
                self.wrong.append((method, path, body, content_type))
                return 400, {}
            if self.fails > 0:
                self.fails -= 1
                return 500, {"error": "not now"}
            if (method, path) == ("GET", "/gameserver"):
                return 200, {"object_meta": {"name": "tandem-x7k2p", "namespace": "default", "labels": {}},
                             "spec": {"health": {"period_seconds": 5, "failure_threshold": 3}},
                             "status": {"state": self.state, "address": "192.0.2.7",
                                        "ports": [{"name": "tandem", "port": 47800}]}}
            states = {"/ready": "Ready", "/allocate": "Allocated", "/shutdown": "Shutdown"}
            if method != "POST" or path not in [*states, "/health"]:
                self.wrong.append((method, path, body, content_type))
                return 404, {}
            self.state = states.get(path, self.state)
            return 200, {}

    def count(self, path):
        with self._lock:
            return sum(1 for _, _, called in self.calls if called == path)

    def paths(self):
        """Returns the called paths in order, except /health."""
        with self._lock:
            return [path for _, _, path in self.calls if path != "/health"]

    def wait_for(self, path, times=1):
        deadline = time.monotonic() + PATIENCE_S
        while self.count(path) < times:
            if time.monotonic() > deadline:
                raise AssertionError(f"{path} was not called {times} times: {self.calls}")
            time.sleep(0.02)

    def stop(self):
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()
