"""The power surface over two rotary angles."""
