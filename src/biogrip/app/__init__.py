"""The window ``biogrip app``: what is chosen on a page becomes options of the command."""
