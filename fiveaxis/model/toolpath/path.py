"""Cutter locations: the record that every later stage starts from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fiveaxis.base import (
    Array,
    BoolArray,
    Finding,
    HasColumns,
    IntArray,
    Place,
    ShownAsTable,
    Table,
    ToolpathError,
    normalise,
)
from fiveaxis.model.toolpath.curve import Curve
from fiveaxis.model.toolpath.cutter import Zone, across
from fiveaxis.model.toolpath.operation import MoveKind, Operation, kind_names
from fiveaxis.model.toolpath.tool import Tool

# A shorter vector isn't accepted as a direction.
SHORTEST_DIRECTION = 1e-6
# What lies between two locations: a smooth curve through them where they are its samples, or their chord.
PathShape = Literal["smooth", "chord"]


@dataclass(frozen=True, eq=False)
class Toolpath(HasColumns, ShownAsTable):
    """Cutter locations in the workpiece frame, one row each.

    The *pivot* stays fixed while the tool leans: the centre of the arc of the cutter's profile that touches
    the surface (a ball's centre), so the contact stays too. Unknown values are NaN.

    Parameters
    ----------
    tool : the cutter
    pivot : (n, 3), mm, workpiece frame; where the normal is unknown the tool axis passes through it
    contact : (n, 3), mm, workpiece frame; cutter contact point, NaN where unknown or in the air
    normal : (n, 3), unit vectors out of the material, NaN where unknown or in the air; a link may keep that
        of the contact that it leaves or reaches
    axis : (n, 3), unit vectors from tip to shank as programmed, NaN where none is
    feed : (n,), mm/s, along the move that ends at the row
    kind : (n,), `MoveKind` values
    source : (n,), line of the source file, or the row of the array (from 1)
    name : of the source file or mesh
    ignored : words of the source that were not used, with their counts
    source_is_line : whether `source` counts lines of the file `name`
    findings : what was assumed or omitted while it was read
    touching : the zone of the cutter's profile that touches; by default the one that is meant to cut
    numbers : (n,), location numbers in findings; with inserted locations those of the given path. None for
        the rows themselves
    rotary : (n, r), rad, chain order: rotary axis values in a program for a specific machine, NaN where it
        has none; None for a source without axes
    normals_from : what the normals are, for reports: ``of the mesh, smoothed …``
    shape : what lies between two locations: a ``smooth`` curve where they tell one (`curve`), or a ``chord``
    straight : (n,), moves to locations that are chords in any case; None for none
    given : (n,), locations that weren't inserted; None where all are given
    inserted_on : the curve between locations as it was before some were inserted; None where none were
    operation : of the program or CL file that it was read from; None for another source
    slack : (n,), mm, in a program that is revised in its own lines: by how much its own block to each
        location leaves the path, so that other blocks may, too; None for other paths
    """

    tool: Tool
    pivot: Array
    contact: Array
    normal: Array
    axis: Array
    feed: Array
    kind: IntArray
    source: IntArray
    name: str = "toolpath"
    ignored: Mapping[str, int] = field(default_factory=dict)
    source_is_line: bool = False
    findings: tuple[Finding, ...] = ()
    touching: Zone | None = None
    numbers: IntArray | None = None
    rotary: Array | None = None
    normals_from: str = "of the path as given"
    shape: PathShape = "chord"
    straight: BoolArray | None = None
    given: BoolArray | None = None
    inserted_on: Curve | None = None
    operation: Operation | None = None
    slack: Array | None = None

    def __post_init__(self) -> None:
        n = len(self.pivot)
        shapes: dict[str, tuple[int, ...]] = dict.fromkeys(("pivot", "contact", "normal", "axis"), (n, 3))
        shapes |= dict.fromkeys(("feed", "kind", "source"), (n,))
        shapes |= {} if self.numbers is None else {"numbers": (n,)}
        for name, shape in shapes.items():
            found = np.shape(getattr(self, name))
            if found != shape:
                raise ToolpathError(f"{name} has shape {found}; {shape} is needed", file=self.name)
        if n == 0:
            raise ToolpathError("no cutter locations", file=self.name)
        if self.rotary is not None and len(self.rotary) != n:
            raise ToolpathError(f"rotary has {len(self.rotary)} rows; {n} are needed", file=self.name)
        unplaced = np.any(np.logical_not(np.isfinite(self.pivot)), axis=1)
        self._check_rows(unplaced, "a position that isn't a finite number")
        moving = np.isfinite(self.feed) & (self.feed > 0.0)
        self._check_rows(np.logical_not(moving), "no positive feed; give one in mm/min (feed)")

    def _check_rows(self, bad: BoolArray, what: str) -> None:
        if bad.any():
            row = int(np.argmax(bad))
            raise ToolpathError(
                f"location {row} has {what} ({int(bad.sum())} such locations)",
                file=self.name,
                line=self.place(row).line,
            )

    @classmethod
    def from_contacts(
        cls,
        contact: ArrayLike,
        normal: ArrayLike,
        tool: Tool,
        *,
        feed_mm_min: ArrayLike = 1000.0,
        source: ArrayLike | None = None,
        name: str = "toolpath",
    ) -> Toolpath:
        """Create a path of cuts from contact points and surface normals, samples of a smooth surface.

        Parameters
        ----------
        contact : (n, 3), mm, workpiece frame
        normal : (n, 3), out of the material, any length but zero
        tool : the cutter
        feed_mm_min : scalar or (n,)
        source : (n,), line numbers; counted from 1 by default

        Raises
        ------
        ToolpathError
            Wrong shapes, numbers that aren't finite, a normal of length zero.
        """
        points = _rows(contact, "contact", name)
        lines = _lines(source, len(points))
        normals = _directions(_rows(normal, "normal", name), "normal", lines, name)
        return cls(
            tool=tool,
            pivot=tool.zone.pivot(points, normals),
            contact=points,
            normal=normals,
            axis=np.full_like(points, np.nan),
            feed=np.broadcast_to(np.asarray(feed_mm_min, dtype=float) / 60.0, len(points)).copy(),
            kind=np.full(len(points), MoveKind.CUT, dtype=np.int64),
            source=lines,
            source_is_line=source is not None,
            name=name,
            shape="smooth",
        )

    @classmethod
    def from_tips(
        cls,
        tip: ArrayLike,
        axis: ArrayLike,
        tool: Tool,
        *,
        feed_mm_min: ArrayLike = 1000.0,
        kind: ArrayLike | None = None,
        source: ArrayLike | None = None,
        name: str = "toolpath",
        ignored: Mapping[str, int] | None = None,
        findings: tuple[Finding, ...] = (),
    ) -> Toolpath:
        """Create a path from tool tips and tool axes; the surface stays unknown.

        Parameters
        ----------
        tip, axis : (n, 3), mm, workpiece frame, and directions from tip to shank, any length but zero
        feed_mm_min : scalar or (n,)
        kind : (n,), `MoveKind` values; cuts by default
        source : (n,), line numbers; counted from 1 by default

        Raises
        ------
        ToolpathError
            As `from_contacts`, of the axis.
        """
        points = _rows(tip, "tip", name)
        lines = _lines(source, len(points))
        axes = _directions(_rows(axis, "axis", name), "tool axis", lines, name)
        unknown = np.full_like(points, np.nan)
        return cls(
            tool=tool,
            pivot=tool.zone.pivot_of_tip(points, unknown, axes),
            contact=unknown,
            normal=unknown.copy(),
            axis=axes,
            feed=np.broadcast_to(np.asarray(feed_mm_min, dtype=float) / 60.0, len(points)).copy(),
            kind=np.zeros(len(points), dtype=np.int64) if kind is None else np.asarray(kind, dtype=np.int64),
            source=lines,
            source_is_line=source is not None,
            name=name,
            ignored={} if ignored is None else dict(sorted(ignored.items())),
            findings=findings,
        )

    def __repr__(self) -> str:
        name, cuts, length = self.name or "unnamed", int(self.cutting.sum()), float(self.lengths.sum())
        return f"<Toolpath {name}: {len(self)} locations, {cuts} cuts, {length:.0f} mm, {self.tool}>"

    def _table(self) -> Table:
        low, high = self.feed.min() * 60.0, self.feed.max() * 60.0
        counts = (f"{int((self.kind == kind).sum())} {kind.name.lower()}" for kind in MoveKind)
        corners = zip("XYZ", self.pivot.min(axis=0), self.pivot.max(axis=0), strict=True)
        rows = [
            ("tool", self.tool),
            ("moves", ", ".join(counts)),
            ("feed", f"{low:g} mm/min" if low == high else f"{low:g} … {high:g} mm/min"),
            ("pivots", "; ".join(f"{c} {start:.3f} … {end:.3f} mm" for c, start, end in corners)),
            ("surface normals", "of every cut" if self.has_normals else "not of every cut"),
            ("tool axes", "of every location" if self.has_axes else "not of every location"),
            ("findings", len(self.findings)),
        ]
        return ("of the path", ""), rows

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return the locations by columns, (n,) each; what is unknown is NaN.

        Returns
        -------
        ``location`` (its number in findings), ``file``, ``line`` (of the file, or the row of the array from
        1), ``kind`` (``cut``, ``link`` or ``rapid``), ``feed_mm_min``, ``length_mm`` (of the move that ends
        there); by x, y and z in the workpiece frame ``pivot_x_mm``, ``contact_x_mm``, ``normal_x``,
        ``axis_x``, and ``tip_x_mm`` of the programmed axis
        """
        found: dict[str, NDArray[Any]] = {
            "location": self.numbered,
            "file": np.full(len(self), self.name),
            "line": self.source,
            "kind": kind_names(self.kind),
            "feed_mm_min": self.feed * 60.0,
            "length_mm": self.lengths,
        }
        points = {"pivot": self.pivot, "contact": self.contact, "tip": self.tips(self.axis)}
        for name, vectors in points.items():
            found |= {f"{name}_{c}_mm": vectors[:, k] for k, c in enumerate("xyz")}
        for name, vectors in {"normal": self.normal, "axis": self.axis}.items():
            found |= {f"{name}_{c}": vectors[:, k] for k, c in enumerate("xyz")}
        return found

    def __len__(self) -> int:
        return len(self.pivot)

    @property
    def count_given(self) -> int:
        """Number of locations that weren't inserted."""
        return len(self) - int(self.inserted.sum())

    @property
    def inserted(self) -> BoolArray:
        """(n,), locations that were inserted between given ones."""
        return np.zeros(len(self), dtype=bool) if self.given is None else ~self.given

    @property
    def numbered(self) -> IntArray:
        """(n,), location numbers in findings."""
        return np.arange(len(self)) if self.numbers is None else self.numbers

    def place(self, row: int) -> Place:
        """Return the place of a location, for findings."""
        line = int(self.source[row]) if self.source_is_line else None
        location = int(row if self.numbers is None else self.numbers[row])
        return Place(location=location, line=line, file=self.name)

    def passes(self, rows: IntArray) -> list[IntArray]:
        """Split rows that cut, (m,) in order, by pass: no link and no rapid move lies between two of one."""
        number = np.cumsum(~self.cutting)[rows]
        return np.split(rows, np.flatnonzero(np.diff(number)) + 1) if len(rows) else []

    @cached_property
    def curve(self) -> Curve | None:
        """How the pivot goes from one location to the next; None along chords.

        Moves that cut are curved where their chords meet at small angles that change little, and the normals
        turn with them; not at corners, beside repeated points, or where a long move follows short ones.
        """
        if self.inserted_on is not None or self.shape == "chord":
            return self.inserted_on
        cuts = self.cutting if self.straight is None else np.asarray(self.cutting & ~self.straight)
        if self.zone.offset:
            # Without a normal the pivot of such a cutter isn't known.
            known = np.asarray(np.isfinite(self.normal).all(axis=1))
            cuts = cuts & known & np.append(False, known[:-1])
        return Curve.through(self.pivot, self.normal, cuts)

    @property
    def curved(self) -> BoolArray:
        """(n,), whether the move that ends at the location follows a curve."""
        return np.zeros(len(self), dtype=bool) if self.curve is None else self.curve.bent

    @property
    def zone(self) -> Zone:
        """The part of the cutter's profile that touches."""
        return self.tool.zone if self.touching is None else self.touching

    @property
    def cutting(self) -> BoolArray:
        """(n,), whether the move that ends at the location cuts."""
        return self.kind == MoveKind.CUT

    @property
    def bounding(self) -> BoolArray:
        """(n,), whether a cut begins or ends at the location: there bounds on the tool's lean hold."""
        return self.cutting | np.append(self.cutting[1:], False)

    @property
    def feed_is_assumed(self) -> bool:
        """Whether the source states no feed."""
        return any(finding.code == "feed-assumed" for finding in self.findings)

    @property
    def rapid(self) -> BoolArray:
        """(n,), whether the move that ends at the location is a rapid move."""
        return self.kind == MoveKind.RAPID

    @property
    def has_normals(self) -> bool:
        """Whether every cut has a surface normal."""
        return bool(np.isfinite(self.normal[self.cutting]).all())

    @property
    def has_axes(self) -> bool:
        """Whether every location has a programmed tool axis."""
        return bool(np.isfinite(self.axis).all())

    @cached_property
    def lengths(self) -> Array:
        """(n,), mm: length of the pivot's path from the previous location, 0 for the first."""
        if self.curve is not None:
            return self.curve.lengths(self.pivot)
        steps = np.linalg.norm(np.diff(self.pivot, axis=0), axis=1)
        return np.concatenate([[0.0], steps])

    def tips(self, axis: Array) -> Array:
        """Compute the tip for tool axes, (n, 3) unit vectors, that keeps the contact; (n, 3) mm."""
        return self.zone.tip(self.pivot, self.normal, axis)

    def centres(self, axis: Array, rows: IntArray | slice = slice(None)) -> Array:
        """Compute the point of the tool axis at the height of the touching arc, (m, 3) mm: a ball's centre.

        Parameters
        ----------
        axis : (m, 3), unit vectors, at `rows`
        """
        pivot, offset = self.pivot[rows], self.zone.offset
        return pivot + offset * across(self.normal[rows], axis) if offset else pivot

    def touching_at(self, normal: Array) -> Toolpath:
        """Return the path with unit normals out of the material, (n, 3), NaN where nothing is touched.

        The programmed tips are kept. `ToolError` if the cutter has no single contact at some angle to the
        normal.
        """
        tip = self.tips(self.axis)
        touching = np.isfinite(normal).all(axis=1)
        zone = self.zone
        contact = np.full_like(tip, np.nan)
        contact[touching] = self.tool.cutter.contacts(tip[touching], normal[touching], self.axis[touching])
        pivot = zone.pivot_of_tip(tip, normal, self.axis)
        return replace(self, pivot=pivot, contact=contact, normal=np.array(normal), inserted_on=None)

    def in_zone(self, zone: Zone) -> Toolpath:
        """Return the path with another zone of the cutter's profile on the same contacts.

        Rows without a contact keep the tip of their programmed axis; without an axis, their pivot.
        """
        if zone == self.zone:
            return self
        free = zone.pivot_of_tip(self.tips(self.axis), self.normal, self.axis)
        pivot = np.where(np.isfinite(free), free, self.pivot)
        touched = np.isfinite(self.contact) & np.isfinite(self.normal)
        pivot = np.where(touched, zone.pivot(self.contact, self.normal), pivot)
        return replace(self, pivot=pivot, touching=zone, inserted_on=None)

    def at(self, rows: IntArray) -> Toolpath:
        """Return the path through some of its locations, given by their indices."""
        columns = ("pivot", "contact", "normal", "axis", "feed", "kind", "source")
        known = tuple(
            name
            for name in ("rotary", "numbers", "straight", "given", "slack")
            if getattr(self, name) is not None
        )
        curve = None if self.inserted_on is None else self.inserted_on.at(rows)
        some = {name: getattr(self, name)[rows] for name in (*columns, *known)}
        return replace(self, **some, inserted_on=curve)

    def shaped(self, shape: PathShape) -> Toolpath:
        """Return the given locations with smooth curves between them where they tell them, or with chords."""
        own = self.at(np.flatnonzero(~self.inserted)) if self.inserted.any() else self
        return replace(own, shape=shape, straight=None, given=None, inserted_on=None)

    def with_links(self, links: BoolArray) -> Toolpath:
        """Return the path with the marked rows, (n,), as links: they keep the pivot and lose the contact."""
        air = np.where(links[:, None], np.nan, 0.0)
        return replace(
            self,
            contact=self.contact + air,
            normal=self.normal + air,
            kind=np.where(links, MoveKind.LINK, self.kind),
        )

    def with_rapid(self, feed_mm_min: float) -> Toolpath:
        """Return the path with one feed for rapid moves, mm/min."""
        return replace(self, feed=np.where(self.rapid, feed_mm_min / 60.0, self.feed))

    def with_rapids(self, rapid: BoolArray) -> Toolpath:
        """Return the path with the marked rows, (n,), as rapid moves; see `with_links`."""
        return replace(self.with_links(rapid), kind=np.where(rapid, MoveKind.RAPID, self.kind))


def _rows(values: ArrayLike, what: str, name: str) -> Array:
    rows = np.array(values, dtype=float)
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise ToolpathError(f"{what} has shape {rows.shape}; (n, 3) is needed", file=name)
    return rows


def _lines(source: ArrayLike | None, n: int) -> IntArray:
    return np.arange(1, n + 1) if source is None else np.asarray(source, dtype=np.int64)


def _directions(rows: Array, what: str, lines: IntArray, name: str) -> Array:
    lengths = np.linalg.norm(rows, axis=1)
    bad = ~(lengths > SHORTEST_DIRECTION)
    if bad.any():
        row = int(np.argmax(bad))
        fact = "a length that isn't a number" if np.isnan(lengths[row]) else f"length {lengths[row]:g}"
        raise ToolpathError(
            f"the {what} of location {row} has {fact}; a direction is needed", file=name, line=int(lines[row])
        )
    return normalise(rows)
