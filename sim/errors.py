"""Exceptions. The message for bad input names a thing, a reason and a remedy. Each message is one line."""

__all__ = ["CompilerMissing", "InputError", "OptionError", "SimulationError", "one_line"]


def one_line(text: str, most: int = 1000) -> str:
    """Text for a message, made from a text of unknown content: one line of limited length.

    The text may come from a user, a file or another program. Characters that cannot be printed become ``?``.
    These are line breaks, escape sequences of a terminal, and bytes that are not text.

    Parameters
    ----------
    text : str
        The text.
    most : int
        Largest number of characters. A longer text is cut to this number and ends with ``...``.
    """
    text = "".join(c if c.isprintable() else "?" for c in text[: most + 1])
    return text if len(text) <= most else f"{text[: most - 3]}..."


class InputError(Exception):
    """Bad input from a user: a file, a value, an option.

    The command line prints it as one line and ends with exit status 2.

    Parameters
    ----------
    thing : str
        The bad input: a file's name, or an option and its value.
    reason : str
        Why the input cannot be used.
    remedy : str
        An action that corrects the input.
    """

    def __init__(self, thing: str, reason: str, remedy: str):
        self.thing = one_line(thing, 400)
        self.reason = one_line(reason)
        self.remedy = one_line(remedy)
        super().__init__(f"{self.thing}: {self.reason}; {self.remedy}")

    def __reduce__(self):
        """How pickle rebuilds the error in another process."""
        return InputError, (self.thing, self.reason, self.remedy)


class OptionError(InputError):
    """Bad value of an option. The thing is the option's name in Python with the value.

    The value may come from a scene file or from the command line. `at` makes an error that names this place.

    Parameters
    ----------
    option : str
        Name of the option.
    value : object
        Its value. If this is an empty text, the message shows only the name.
    reason, remedy : str
        As in `InputError`.
    """

    def __init__(self, option: str, value: object, reason: str, remedy: str):
        self.option = option
        if isinstance(value, tuple | list):
            value = ",".join(f"{part:g}" for part in value)
        self.value = str(value)
        super().__init__(f"{option} {self.value}".strip(), reason, remedy)

    def at(self, place: str) -> InputError:
        """An `InputError` with this reason and remedy, whose thing is ``place``."""
        return InputError(place, self.reason, self.remedy)


class SimulationError(Exception):
    """A simulation failed: the component broke the rules of streams or got stuck, or no engine can run it.

    The message is one line.
    """


class CompilerMissing(SimulationError):
    """No C++ compiler works. The message names the compilers that were tried, and a remedy."""
