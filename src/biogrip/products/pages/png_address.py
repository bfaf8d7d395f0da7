"""Pictures inside a page."""

import base64


def png_address(content: bytes) -> str:
    """Return a PNG as an address that holds it (RFC 2397)."""
    return "data:image/png;base64," + base64.b64encode(content).decode()
