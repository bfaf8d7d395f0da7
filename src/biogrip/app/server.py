"""The command ``biogrip app``: a page of this machine alone, that calls what the command calls.

Flask answers, behind Waitress, which listens on 127.0.0.1. Whoever does not know the token in the
address, comes by another name of the host, or from another page, is refused.
"""

import os
import secrets
import signal
import sys
import webbrowser
from collections import defaultdict
from io import BytesIO
from pathlib import Path
from shutil import rmtree
from tempfile import TemporaryDirectory, gettempdir, mkdtemp

from biogrip.app.choices import CHOICES, KNOWN, TICKED, remedies_by_column, with_option
from biogrip.app.window import LARGEST_MB, LONGEST_S, Window
from biogrip.errors import BiogripError
from biogrip.files import left_in
from biogrip.page.templates import environment
from biogrip.physics.instruments import INSTRUMENTS, KNOWN_SHAPES
from biogrip.physics.models import CANDIDATES, MODELS
from biogrip.physics.sample_model import sketched
from biogrip.traces.columns import TIME_UNITS
from biogrip.traces.reader import form_in_words

try:
    import waitress
    from flask import Flask, Response, abort, redirect, request, send_file
    from flask.typing import ResponseReturnValue
except ModuleNotFoundError as error:
    raise BiogripError(f"app: needs {error.name}: python -m pip install '.[app]'") from error

_HERE, _DATA = Path(__file__).parent, Path(__file__).parents[3] / "data"
_OUTPUTS = "page.html", "figure.png", "table.csv", "result.json", "groups.csv", "groups.png"
_POLICY = "default-src 'self' 'unsafe-inline'; img-src 'self' data:; frame-ancestors 'self'"
_HEADERS = {"Content-Security-Policy": _POLICY, "X-Content-Type-Options": "nosniff"}
_SHOWN = {
    **{"known": KNOWN, "instruments": INSTRUMENTS, "limits": (LARGEST_MB, LONGEST_S // 60)},
    **{"candidates": CANDIDATES, "shapes": KNOWN_SHAPES, "units": TIME_UNITS, "outputs": _OUTPUTS},
    **{"remedies_by_column": remedies_by_column, "form_in_words": form_in_words},
    **{"models": (*MODELS, "generalized_maxwell_2"), "sketched": sketched},
}


def open_app(port: int = 0, *, no_browser: bool = False) -> None:
    """Serve the window until it is stopped, and open it in a browser; print its address."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        # So that what is temporary goes, too. Windows has no SIGHUP.
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), lambda *_: sys.exit())
    for left in left_in(Path(gettempdir()), "biogrip.[0-9]*.*"):
        rmtree(left, ignore_errors=True)
    with TemporaryDirectory(prefix=f"biogrip.{os.getpid()}.") as folder:
        windows = defaultdict[str, Window](lambda: Window(Path(mkdtemp(dir=folder))))
        app = app_of(windows, token := secrets.token_urlsafe(24))
        server = waitress.create_server(app, host="127.0.0.1", port=port)
        address = f"http://127.0.0.1:{server.effective_port}/{token}/"
        print(f"{address}\nOpen this address in a browser here; Ctrl-C ends it.", flush=True)
        if not no_browser:
            webbrowser.open(address)
        server.run()
        for window in windows.values():
            window.stop()


def app_of(windows: dict[str, Window], token: str) -> Flask:
    """Return the application: windows by name, which share nothing."""
    app = Flask(__name__, static_folder=None)
    app.config["MAX_CONTENT_LENGTH"] = LARGEST_MB * 1_000_000
    template = environment(_HERE).get_template("window.html.j2")

    @app.before_request
    def refuse_others() -> None:
        """Refuse other hosts, other origins, and who does not know the token."""
        hosts = [f"{name}:{request.environ['SERVER_PORT']}" for name in ("127.0.0.1", "localhost")]
        own = f"http://{request.host}"
        asks = request.headers.get("Origin", own if request.method == "GET" else "")
        known = secrets.compare_digest(request.path.split("/")[1].encode(), token.encode())
        if not known or request.host not in hosts or asks != own:
            abort(403)

    @app.after_request
    def limit_page(response: Response) -> Response:
        """Let no page load anything from elsewhere."""
        response.headers.update({**_HEADERS, **response.headers})
        return response

    @app.get("/<_>/")
    def open_window(_: str) -> ResponseReturnValue:
        """Begin a window."""
        return redirect(f"{secrets.token_urlsafe(8)}/")

    @app.get("/<_>/<name>/")
    def show(_: str, name: str) -> ResponseReturnValue:
        """Show a window as it is: it stays when it is loaded anew."""
        return template.render(window=windows[name], **_SHOWN)

    @app.get("/<_>/<name>/out/<file>")
    def download(_: str, name: str, file: str) -> ResponseReturnValue:
        """Send a result, which in a sandbox has no access to the window."""
        if file not in _OUTPUTS or not (content := windows[name].output(file)):
            abort(404)
        response = send_file(BytesIO(content), download_name=file)
        response.headers["Content-Security-Policy"] = f"sandbox allow-scripts; {_POLICY}"
        return response

    @app.post("/<_>/<name>/<action>")
    def act(_: str, name: str, action: str) -> ResponseReturnValue:
        """Do what is asked in a window, and show it."""
        with windows[name].lock:
            _do(action, windows[name])
        return show(_, name)

    return app


def _do(action: str, window: Window) -> None:
    """Take what is chosen, and do one thing more."""
    given, do = request.form, request.form.get("do", "")
    drawn = [window.chosen[name] for name in (window.axis, "column")]
    window.chosen |= {key: given.get(key, "") for key in CHOICES if key in (*given, *TICKED)}
    if action == "files":
        for file in request.files.getlist("files"):
            window.add(file.filename or "", file.stream)
    elif action == "example":
        known = KNOWN["examples"][do]
        path = next(_HERE.glob(f"examples/{known['file']}"), _DATA / known["file"])
        window.names, window.config, window.chosen = [], [], dict.fromkeys(CHOICES, "") | known
        window.add(path.name, BytesIO(path.read_bytes()))
    elif action == "option":
        option, _, value = do.partition(" ")
        window.chosen |= with_option(option, value, window.chosen["more"])
    if action != "show" and window.names:
        window.check()
    # The picture follows what is read.
    if (now := [window.chosen[name] for name in (window.axis, "column")]) != drawn:
        window.chosen |= {"across": now[0], "upward": now[1]}
    if action in ("stop", "compare") or (action == "start" and window.traces):
        getattr(window, action)()
