"""The command ``biogrip identify`` and its likes in a notebook: what is asked, read and written."""
