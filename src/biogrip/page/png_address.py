"""Data URLs of PNG images."""

import base64


def png_address(content: bytes) -> str:
    """Return a PNG as a data URL (RFC 2397)."""
    return "data:image/png;base64," + base64.b64encode(content).decode()
