"""Data URLs of figures."""

from io import BytesIO

from matplotlib.figure import Figure

from biogrip.products.figures.style import save_png
from biogrip.products.pages.png_address import png_address


def figure_address(drawn: Figure) -> str:
    """Return a figure as a data URL for an image on a page."""
    content = BytesIO()
    save_png(drawn, content)
    return png_address(content.getvalue())
