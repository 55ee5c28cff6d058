"""The one exception for bad input: a thing, a reason, a remedy."""

__all__ = ["InputError", "one_line"]


def one_line(text: str, most: int = 1000) -> str:
    """Text of a user, a file or another program, fit for a message: in one line, and not too long.

    What cannot be printed (line breaks, a terminal's escape sequences, bytes that are no text) becomes ``?``.

    Parameters
    ----------
    text : str
        The text.
    most : int
        Characters, of which the last three become ``...`` where there are more.
    """
    text = "".join(c if c.isprintable() else "?" for c in text[: most + 1])
    return text if len(text) <= most else f"{text[: most - 3]}..."


class InputError(Exception):
    """Bad input from a user: a file, a value, an option.

    The command line prints it as one line and ends with exit status 2.

    Parameters
    ----------
    thing : str
        What is wrong: the file's name, the option and its value.
    reason : str
        Why it cannot be used.
    remedy : str
        What to do about it.
    """

    def __init__(self, thing: str, reason: str, remedy: str):
        self.thing = one_line(thing, 400)
        self.reason = one_line(reason)
        self.remedy = one_line(remedy)
        super().__init__(f"{self.thing}: {self.reason}; {self.remedy}")

    def __reduce__(self):
        """How it crosses from one process to another."""
        return type(self), (self.thing, self.reason, self.remedy)
