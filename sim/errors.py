"""The one exception for bad input: a thing, a reason, a remedy."""

__all__ = ["InputError"]


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
        super().__init__(f"{thing}: {reason}; {remedy}")
        self.thing = thing
        self.reason = reason
        self.remedy = remedy

    def __reduce__(self):
        """How it crosses from one process to another."""
        return type(self), (self.thing, self.reason, self.remedy)
