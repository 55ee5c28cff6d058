"""Exceptions for bad input: a thing, a reason, a remedy."""

__all__ = ["InputError", "OptionError", "one_line"]


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
        return InputError, (self.thing, self.reason, self.remedy)


class OptionError(InputError):
    """Bad value of an option, by the option's name in Python.

    The value may come from a scene file or from the command line, which `at` makes the message name.

    Parameters
    ----------
    option : str
        Name of the option.
    value : object
        Its value; of an empty text only the name is shown.
    reason, remedy : str
        As of `InputError`.
    """

    def __init__(self, option: str, value: object, reason: str, remedy: str):
        self.option = option
        if isinstance(value, tuple | list):
            value = ",".join(f"{part:g}" for part in value)
        self.value = str(value)
        super().__init__(f"{option} {self.value}".strip(), reason, remedy)

    def at(self, place: str) -> InputError:
        """The same error of a thing with another name."""
        return InputError(place, self.reason, self.remedy)
