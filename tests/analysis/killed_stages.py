"""A run that is killed between two stages, as tests of --resume need it."""

from microsurf.analysis.stages import Stages


class KilledError(Exception):
    """The process ends here."""


class Mortal(Stages):
    """Ends after so many stages were made."""

    left = 1

    def done(self, name, make):
        """As of any run, but for the end."""

        def counted():
            if self.left == 0:
                raise KilledError
            self.left -= 1
            return make()

        return super().done(name, counted)
