"""A solution with the constraints it was chosen within, so that it can become a verified program."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from fiveaxis.base import Finding, group_findings, keywords_of
from fiveaxis.check import (
    DEFAULT_TOLERANCES,
    CheckedInterpolation,
    Report,
    Surroundings,
    Tolerances,
    verify_within,
)
from fiveaxis.job.program import MadeProgram, make_program
from fiveaxis.model import Constraints
from fiveaxis.nc import ProgramOptions, tool_comments
from fiveaxis.posture import Optimum

if TYPE_CHECKING:
    from fiveaxis.show import Preview

Found = TypeVar("Found", bound=Optimum)


def add_findings(solution: Found, *findings: Finding) -> Found:
    """Add findings to a solution's path, from where every report of it takes them."""
    path = solution.toolpath
    return replace(solution, toolpath=replace(path, findings=(*path.findings, *findings)))


@dataclass(frozen=True, eq=False, repr=False)
class Solution(Optimum):
    """Optimum with what they were chosen within, which also applies to the programs made of them.

    Parameters
    ----------
    constraints : on postures and turns
    surroundings : part, stock and fixtures that the tool was kept clear of
    tolerances : from where on a difference is a finding
    """

    constraints: Constraints = field(default_factory=Constraints)
    surroundings: Surroundings = field(default_factory=Surroundings)
    tolerances: Tolerances = DEFAULT_TOLERANCES

    @classmethod
    def of(
        cls, postures: Optimum, constraints: Constraints, surroundings: Surroundings, gouge_tolerance: float
    ) -> Solution:
        """Add to postures what they were chosen within.

        Parameters
        ----------
        gouge_tolerance : mm, how deep the cutter may reach into the part

        Raises
        ------
        SettingError
            A gouge tolerance that isn't finite and above 0.
        """
        own = {f.name: getattr(postures, f.name) for f in fields(Optimum)}
        tolerances = DEFAULT_TOLERANCES.with_gouge(gouge_tolerance)
        return cls(**own, constraints=constraints, surroundings=surroundings, tolerances=tolerances)

    def verify(self) -> Report:
        """Check the motion as `fiveaxis.verify` does, against everything that it was chosen within.

        Raises
        ------
        FiveAxisError
            As `fiveaxis.verify`.
        """
        return verify_within(
            self.constraints,
            self.motion,
            self.machine,
            self.toolpath,
            self.surroundings,
            CheckedInterpolation.of(None),
            self.tolerances,
        )

    def summary(self) -> str:
        """Say in a few lines what it costs, against which baseline, and what verification finds, by cause.

        Raises
        ------
        FiveAxisError
            As `verify`.
        """
        report = self.verify()
        causes = group_findings((*self.toolpath.findings, *report.findings), report.counts)
        bound = [] if self.left is None else [self.left]
        return "\n".join([repr(self)[1:-1], *bound, *map(str, causes or ["verification: no findings"])])

    def preview(self, *, open_browser: bool | None = None, port: int = 0) -> Preview:
        """Show the motion with what stands around it in a browser, as `fiveaxis.preview` does."""
        from fiveaxis.show import preview

        return preview(self, surroundings=self.surroundings, open_browser=open_browser, port=port)

    @keywords_of(ProgramOptions)
    def program(self, options: ProgramOptions) -> MadeProgram:
        """Make the NC program of this solution, read its text back, and verify it.

        Parameters
        ----------
        settings : tool, spindle, coolant, work offset and so on
        header : name and value of further comments

        Raises
        ------
        FiveAxisError
            A control that can't write it, or a text that can't be read back.
        """
        return self.make(options)

    def make(self, options: ProgramOptions) -> MadeProgram:
        """Make the program as `program` does, with all options in one record."""
        return make_program(
            self.motion,
            self.machine,
            self.toolpath,
            self.constraints,
            replace(
                options.on(self.machine),
                header=tool_comments(self.toolpath.tool) | dict(options.header or {}),
            ),
            around=self.surroundings,
            tolerances=self.tolerances,
        )

    @keywords_of(ProgramOptions)
    def write(self, path: str | Path, options: ProgramOptions) -> Report:
        """Write the verified program to a file, whole or not at all; options as for `program`.

        Returns
        -------
        The report on the program's text

        Raises
        ------
        Unverified
            The text has an error that isn't accepted.
        FiveAxisError
            As `program`; a file that can't be written.
        """
        made = self.make(options.on(self.machine).for_file(path))
        made.write(path)
        return made.report
