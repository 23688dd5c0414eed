"""What the functions of an element are given: frames, velocities, angles over many turns, reactions; and what forces are given to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ._functions import atan2, cos, sin
from ._tracing import Number, Real, Tape, Vec, refuse


def _vector(tape: Tape, word: str, index: int) -> Vec:
    return Vec(*(tape.input(f"{word} {index} {k}") for k in range(3)))


class Frame:
    """A marker on a body: where it is, how it is turned, how it moves. Vectors are in ground directions."""

    def __init__(self, tape: Tape, index: int) -> None:
        self._tape = tape
        self._index = index

    @property
    def position(self) -> Vec:
        """Its origin, m."""
        return _vector(self._tape, "position", self._index)

    @property
    def velocity(self) -> Vec:
        """Velocity of its origin, m/s."""
        return _vector(self._tape, "velocity", self._index)

    @property
    def angular_velocity(self) -> Vec:
        """Angular velocity of its body, rad/s."""
        return _vector(self._tape, "angular-velocity", self._index)

    def _axis(self, column: int) -> Vec:
        return Vec(*(self._tape.input(f"rotation {self._index} {row} {column}") for row in range(3)))

    @property
    def x(self) -> Vec:
        """Its x axis, a unit vector."""
        return self._axis(0)

    @property
    def y(self) -> Vec:
        """Its y axis, a unit vector."""
        return self._axis(1)

    @property
    def z(self) -> Vec:
        """Its z axis, a unit vector. By convention the axis of a joint."""
        return self._axis(2)

    def direction(self, local: Any) -> Vec:
        """A direction given in its axes, in ground directions."""
        along = Vec.of(local)
        return self.x * along.x + self.y * along.y + self.z * along.z

    def point(self, local: Any) -> Vec:
        """A point given in its axes from its origin, in the ground frame, m."""
        return self.position + self.direction(local)

    def velocity_at(self, point: Any) -> Vec:
        """Velocity of the point of its body that is at `point` (m, ground frame) now, m/s."""
        return self.velocity + self.angular_velocity.cross(Vec.of(point) - self.position)


class Reaction:
    """What a joint does to the last of its bodies, in ground directions."""

    def __init__(self, tape: Tape, index: int) -> None:
        self.force: Vec = _vector(tape, "reaction-force", index)
        """Force at the origin of the joint's last frame, N."""
        self.torque: Vec = _vector(tape, "reaction-torque", index)
        """Torque, N m."""


class Motion:
    """Where the bodies of an element are and how they move. `at[0]` and `at["i"]` are its frames."""

    def __init__(self, tape: Tape, frames: Sequence[str], joints: Sequence[str]) -> None:
        self._tape = tape
        self._frames = list(frames)
        self._joints = list(joints)
        self._angles: list[Number] = []
        self._pairs: list[str] = []

    def __getitem__(self, frame: int | str) -> Frame:
        return Frame(self._tape, self._index(frame))

    def __len__(self) -> int:
        return len(self._frames)

    def _index(self, frame: int | str) -> int:
        if isinstance(frame, str) and frame in self._frames:
            return self._frames.index(frame)
        if isinstance(frame, int) and 0 <= frame < len(self._frames):
            return frame
        refuse("ODY0832", f"there is no frame {frame!r}", f"the frames are {', '.join(map(repr, self._frames)) or 'none'}")

    @property
    def time(self) -> Number:
        """Time, s."""
        return self._tape.input("time")

    def reaction(self, joint: int | str = 0) -> Reaction:
        """What a joint does that the element depends on, by its name in `joints=` or its number."""
        if isinstance(joint, str) and joint in self._joints:
            return Reaction(self._tape, self._joints.index(joint))
        if isinstance(joint, int) and 0 <= joint < len(self._joints):
            return Reaction(self._tape, joint)
        refuse("ODY0832", f"there is no joint {joint!r}", "name it: @odyn.force(..., joints=['slider'])")

    def angle(self, sin_: Real, cos_: Real) -> Number:
        """The angle of the point (cos, sin) in rad, continuous over any number of turns.

        The host keeps a reference per angle, which changes between steps only; the angle is the one within half a turn of it.
        """
        pair = f"{sin_!r} {cos_!r}"
        if pair in self._pairs:
            return self._angles[self._pairs.index(pair)]
        reference = self._tape.input(f"angle-reference {len(self._angles)}")
        s, c = sin(reference), cos(reference)
        angle: Number = reference + atan2(sin_ * c - cos_ * s, cos_ * c + sin_ * s)
        self._angles.append(angle)
        self._pairs.append(pair)
        return angle

    def angle_about_z(self, i: int | str = 0, j: int | str = 1) -> Number:
        """The angle by which frame `j` is turned against frame `i` about their common z axis, rad, over any number of turns."""
        a, b = self[i], self[j]
        return self.angle(b.x.dot(a.y), b.x.dot(a.x))

    def spin_about_z(self, i: int | str = 0, j: int | str = 1) -> Number:
        """Angular velocity of frame `j` against frame `i` about the z axis of frame `i`, rad/s."""
        return (self[j].angular_velocity - self[i].angular_velocity).dot(self[i].z)

    def relative_velocity(self, i: int | str = 0, j: int | str = 1) -> Vec:
        """Velocity of the origin of frame `j` against that of frame `i`, m/s, ground directions (not as seen from body i)."""
        return self[j].velocity - self[i].velocity


class Loads:
    """Takes forces and torques on the bodies of an element; contributions add up."""

    def __init__(self, at: Motion) -> None:
        self._at = at
        self._sums: dict[tuple[str, int], Vec] = {}

    def _add(self, word: str, frame: int | str, load: Any) -> None:
        key = (word, self._at._index(frame))
        load = Vec.of(load)
        self._sums[key] = self._sums[key] + load if key in self._sums else load

    def force(self, frame: int | str, force: Any) -> None:
        """A force (N) on the body of a frame, at the frame's origin."""
        self._add("force", frame, force)

    def torque(self, frame: int | str, torque: Any) -> None:
        """A torque (N m) on the body of a frame."""
        self._add("torque", frame, torque)

    def force_at(self, frame: int | str, point: Any, force: Any) -> None:
        """A force (N) on the body of a frame, at `point` (m, ground frame)."""
        self.force(frame, force)
        self.torque(frame, (Vec.of(point) - self._at[frame].position).cross(force))

    def force_pair(self, i: int | str, j: int | str, force: Any) -> None:
        """Action and reaction: a force at the origin of frame `j`, and its opposite on the body of frame `i` along the same line."""
        force = Vec.of(force)
        lever = self._at[j].position - self._at[i].position
        self.force(j, force)
        self.force(i, -force)
        self.torque(i, -lever.cross(force))

    def force_pair_at(self, i: int | str, j: int | str, point: Any, force: Any) -> None:
        """Action and reaction at `point` (m, ground frame): a force on the body of frame `j`, its opposite on that of frame `i`."""
        force = Vec.of(force)
        self.force_at(j, point, force)
        self.force_at(i, point, -force)

    def torque_pair(self, i: int | str, j: int | str, torque: Any) -> None:
        """Action and reaction: a torque on the body of frame `j`, its opposite on that of frame `i`."""
        torque = Vec.of(torque)
        self.torque(j, torque)
        self.torque(i, -torque)
