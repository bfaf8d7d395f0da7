"""The command ``biogrip design``: experimental design, written as a config and a page."""
