"""Numbers of things in messages: the one place of the package that knows of singular and plural."""


def counted(count, one, many=None):
    """So many of what one is called, with commas between thousands: "1 cell", "0 cells", "12,345 cells"."""
    return f"{count:,} {one if count == 1 else many or one + 's'}"
