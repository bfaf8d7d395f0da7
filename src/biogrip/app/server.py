"""The command ``biogrip app``: a page of this machine alone, that calls what the command calls.

Flask answers, behind Waitress, which listens on 127.0.0.1. Whoever does not know the token in the
address, comes by another name of the host, or from another page, is refused.
"""

import secrets
import signal
import sys
import webbrowser
from hmac import compare_digest
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NoReturn

import waitress
from flask import Flask, Response, abort, redirect, request, send_file
from flask.typing import ResponseReturnValue
from werkzeug.exceptions import HTTPException

from biogrip.app.choices import CHOICES, remedies_in, with_option
from biogrip.app.preview import network_of
from biogrip.app.window import LONGEST_S, MOST_FILES, Window
from biogrip.errors import BiogripError
from biogrip.page.templates import environment
from biogrip.physics.instruments import INSTRUMENTS, KINDS, PARTNERS, of_kind
from biogrip.physics.models import ALIASES, CANDIDATES
from biogrip.physics.shapes import KNOWN_SHAPES
from biogrip.traces.columns import TIME_UNITS

LARGEST_MB = 200
"""Of all files that are dropped at once."""

_HERE = Path(__file__).parent
_EXAMPLES = {
    "a pipette": ("pipette.csv", {"hold": "400 Pa", "shape": "pipette 3 um"}, "zener_kelvin"),
    "an AFM dwell": ("afm.csv", {"shape": "sphere 2.5 um"}, "zener_maxwell"),
    "a frequency sweep": ("sweep.csv", {}, "springpot_beside_damper"),
    "the gripper": ("example_trace.csv", {}, "generalized_maxwell"),
}
_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src 'self' "
    "data:; connect-src 'self'; frame-src 'self'; frame-ancestors 'self'; base-uri 'none'"
)


def open_app(port: int = 0, *, no_browser: bool = False) -> None:
    """Serve the window until it is stopped, and open it in a browser; print its address."""
    with TemporaryDirectory(prefix="biogrip_") as folder:
        windows: dict[str, Window] = {}
        token = secrets.token_urlsafe(24)
        try:
            server = waitress.create_server(
                app_of(Path(folder).resolve(), token, windows), host="127.0.0.1", port=port
            )
        except OSError as error:
            raise BiogripError(f"--port: found {port}: {error.strerror}.") from error
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, _end)
        address = f"http://127.0.0.1:{server.effective_port}/{token}/"
        print(
            f"{address}\nOpen this address in a browser of this machine; Ctrl-C ends it.",
            flush=True,
        )
        if not no_browser:
            webbrowser.open(address)
        server.run()
        for window in windows.values():
            window.stop()


def _end(*_: object) -> NoReturn:
    """End as of itself, so that what is temporary goes."""
    sys.exit(0)


def app_of(folder: Path, token: str, windows: dict[str, Window]) -> Flask:
    """Return the application: its windows, each in folders of its own."""
    app = Flask(__name__, static_folder=None)
    app.config["MAX_CONTENT_LENGTH"] = LARGEST_MB * 1_000_000
    template = environment(_HERE).get_template("window.html.j2")

    @app.before_request
    def refuse_others() -> None:
        """Refuse other hosts, other origins, and who does not know the token."""
        name, _, port = request.host.partition(":")
        origin = request.headers.get("Origin", "" if request.method == "POST" else None)
        if name not in ("127.0.0.1", "localhost") or port != request.environ["SERVER_PORT"]:
            abort(403)
        if origin not in (None, f"http://{request.host}"):
            abort(403)
        if not compare_digest(request.path.split("/")[1].encode(), token.encode()):
            abort(403)

    @app.after_request
    def limit_page(response: Response) -> Response:
        """Let no page load anything else, nor tell its address."""
        response.headers.setdefault("Content-Security-Policy", _POLICY)
        response.headers["Referrer-Policy"] = "same-origin"
        response.headers["X-Content-Type-Options"] = "nosniff"
        response.headers["Cache-Control"] = "no-store"
        return response

    @app.errorhandler(HTTPException)
    def tell(error: HTTPException) -> ResponseReturnValue:
        """Say in a line what is wrong."""
        text = f"found more than {LARGEST_MB} MB at once; allowed are fewer."
        return (text if error.code == 413 else str(error.description)), error.code or 500

    @app.get("/<_>/")
    def open_window(_: str) -> ResponseReturnValue:
        """Begin a window."""
        name = secrets.token_urlsafe(8)
        (folder / name).mkdir()
        windows[name] = Window(folder / name)
        return redirect(f"{name}/")

    def page(window: Window, problem: str = "") -> str:
        preview = command = None
        try:
            command, preview = window.command, window.preview() if window.inputs else None
        except BiogripError as error:
            problem = problem or window.shown(error)
        return template.render(
            **{"window": window, "problem": problem, "command": command, "preview": preview},
            **{"examples": _EXAMPLES, "kinds": KINDS, "of_kind": of_kind, "partners": PARTNERS},
            **{"candidates": CANDIDATES, "aliases": ALIASES, "shapes": KNOWN_SHAPES},
            **{"network_of": network_of, "remedies_in": remedies_in, "units": TIME_UNITS},
            **{"limits": (LARGEST_MB, MOST_FILES, LONGEST_S // 60), "instruments": INSTRUMENTS},
        )

    @app.get("/<_>/<name>/")
    def show(_: str, name: str) -> ResponseReturnValue:
        """Show a window as it is: it stays when it is loaded anew."""
        return page(windows[name]) if name in windows else redirect("../")

    @app.get("/<_>/<name>/out/<file>")
    def download(_: str, name: str, file: str) -> ResponseReturnValue:
        """Send a result; a page with what it may do, which is nothing to this one."""
        allowed = (
            "page.html",
            "table.csv",
            "result.json",
            "figure.png",
            "groups.csv",
            "groups.png",
        )
        if (
            name not in windows
            or file not in allowed
            or not (content := windows[name].output(file))
        ):
            abort(404)
        response = send_file(BytesIO(content), download_name=file)
        if file == "page.html":
            response.headers["Content-Security-Policy"] = f"sandbox allow-scripts; {_POLICY}"
        return response

    @app.post("/<_>/<name>/<action>")
    def do(_: str, name: str, action: str) -> ResponseReturnValue:
        """Do what was asked for in a window, and show it."""
        window = windows.get(name) or abort(404, "This window has gone: load it anew.")
        with window.lock:
            try:
                _act(window, action)
            except BiogripError as error:
                return page(window, window.shown(error))
            return page(window)

    return app


def _act(window: Window, action: str) -> None:
    """Take what is chosen, and do one thing more."""
    given = request.form
    window.chosen |= {key: given[key] for key in CHOICES if key in given}
    window.chosen |= {key: given.get(key, "") for key in ("offset", "no-compare", "contact")}
    names = [instrument.read.name for instrument in of_kind(given.get("kind", ""))]
    if names and window.chosen["reading"] not in names:
        window.chosen["reading"] = names[0]
    if action == "files":
        for file in request.files.getlist("files"):
            window.add(file.filename or "", file.stream)
        if not window.chosen["column"]:
            window.choose_likely()
    elif action == "example":
        file, chosen, model = _EXAMPLES[given["do"]]
        packaged = _HERE / "examples" / file
        path = packaged if packaged.is_file() else _HERE.parents[2] / "data" / file
        window.names = []
        with path.open("rb") as stream:
            window.add(file, stream)
        window.choose_likely()
        window.chosen |= {**chosen, "model": model}
    elif action == "option":
        option, _, value = given["do"].partition(" ")
        window.chosen = with_option(window.chosen, option, value)
    elif action == "start":
        window.start()
    elif action == "stop":
        window.stop()
    elif action == "compare":
        window.compare()
