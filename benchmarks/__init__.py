"""biogrip beside other libraries, timed."""
