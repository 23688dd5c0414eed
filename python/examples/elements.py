"""Elements written in Python: `python elements.py [FOLDER]` writes mechanics.odyn-element, which scenes load without Python.

They are the standard elements `distance-rod`, `translational-spring-damper`, `revolute` and `rotational-inerter` once more, so that both
can be compared, a floor, a drive with states, and a controller that samples.
"""

from __future__ import annotations

import sys
from pathlib import Path

import odyn


@odyn.joint(frames={"i": "its origin is the first end", "j": "its origin is the second end"}, glyph="rod")
class Rod:
    """Massless rod: two points keep their distance.

    With d from i to j, (d . d - L^2) / (2 L) = 0, a length whose derivative is the unit vector along the rod.
    """

    length = odyn.param("m", above=0, doc="Distance of the two points.")

    def residual(self, at: odyn.Motion) -> dict[str, odyn.Number]:
        d = at[1].position - at[0].position
        return {"distance": (d.dot(d) - self.length**2) / (2 * self.length)}


@odyn.force(frames=["i", "j"], glyph="spring")
class SpringDamper:
    """Spring and damper along the line between two points, both with laws that scenes give."""

    stiffness = odyn.param("N/m", min=0, doc="Tension per elongation.")
    damping = odyn.param("N s/m", min=0, default=0, doc="Tension per rate of elongation.")
    free_length = odyn.param("m", min=0, default=0, doc="Distance of the points at which the spring is relaxed.")
    preload = odyn.param("N", default=0, doc="Constant tension, added to the spring's.")
    force_of_elongation = odyn.function_param("m -> N", default=0, doc="Additional tension over the elongation.")
    force_of_speed = odyn.function_param("m/s -> N", variable="v", default=0, doc="Additional tension over the rate.")

    def _line(self, at: odyn.Motion) -> tuple[odyn.Vec, odyn.Number, odyn.Number]:
        d = at[1].position - at[0].position
        length = odyn.length(d)
        return d, length, d.dot(at.relative_velocity(0, 1)) / length

    @odyn.channel("N")
    def force(self, at: odyn.Motion) -> odyn.Number:
        """tension, positive when it pulls the points together"""
        _, length, rate = self._line(at)
        elongation = length - self.free_length
        spring = elongation * self.stiffness + self.preload + self.force_of_elongation(elongation)
        return spring + (rate * self.damping + self.force_of_speed(rate))

    @odyn.channel("m")
    def length(self, at: odyn.Motion) -> odyn.Number:
        """distance of the points"""
        return self._line(at)[1]

    def wrench(self, at: odyn.Motion, out: odyn.Loads) -> None:
        d, length, _ = self._line(at)
        pull = d * (self.force(at) / length)
        out.force(0, pull)
        out.force(1, -pull)


@odyn.joint(frames=["i", "j"], mobility=1, glyph="hinge")
class Hinge:
    """Two bodies turn about a common axis: the z axes of their frames."""

    def residual(self, at: odyn.Motion) -> dict[str, odyn.Number]:
        a, b = at[0], at[1]
        d = b.position - a.position
        return {
            "x": a.x.dot(d),
            "y": a.y.dot(d),
            "z": a.z.dot(d),
            "about y": a.x.dot(b.z),
            "about x": a.y.dot(b.z),
        }

    @odyn.coordinate("rad")
    def angle(self, at: odyn.Motion) -> odyn.Number:
        """angle about z, over any number of turns"""
        return at.angle_about_z(0, 1)

    def pose(self, q: list[odyn.Number]) -> tuple[list[float], list[list[odyn.Number | float]]]:
        s, c = odyn.sin(q[0]), odyn.cos(q[0])
        return [0, 0, 0], [[c, -s, 0], [s, c, 0], [0, 0, 1]]


@odyn.joint(frames={"i": "its z axis points away from the plane", "j": "its origin is the centre of the ball"})
class Floor:
    """A ball on the plane z = 0 of the first frame: it pushes, throws back, and rubs as Coulomb says."""

    radius = odyn.param("m", min=0, default=0, doc="Radius of the ball.")
    restitution = odyn.param("1", min=0, max=1, default=0, doc="Share of the velocity of an impact that is left.")
    mu = odyn.param("1", min=0, default=0, doc="Coefficient of friction.")

    def residual(self, at: odyn.Motion) -> dict[str, odyn.Number]:
        return {"gap": at[0].z.dot(at[1].position - at[0].position) - self.radius}

    def velocity_residual(self, at: odyn.Motion) -> dict[str, odyn.Number]:
        contact = at[1].position - at[0].z * self.radius
        slip = at[1].velocity_at(contact) - at[0].velocity_at(contact)
        return {"along x": at[0].x.dot(slip), "along y": at[0].y.dot(slip)}

    def unilateral(self) -> dict[str, odyn.Number]:
        return {"gap": self.restitution}

    def sticks_with(self) -> dict[str, str]:
        return {"along x": "gap", "along y": "gap"}

    def limit(self, at: odyn.Motion) -> dict[str, odyn.Number]:
        return {"along x": self.mu}

    def slides_with(self) -> dict[str, str]:
        return {"along x": "along y"}


@odyn.force(frames=["i", "j"])
class Flywheel:
    """A wheel that turns with the relative rotation of two bodies, by a gear: mass that is no body."""

    inertance = odyn.param("kg m^2", min=0, doc="Its inertia, times the square of the gear's ratio.")

    def wrench(self, at: odyn.Motion, out: odyn.Loads) -> None:
        pass

    def kinetic(self, at: odyn.Motion) -> odyn.Number:
        rate = at.spin_about_z(0, 1)
        return rate * rate * (0.5 * self.inertance)


@odyn.force(frames=["i", "j"])
class Motor:
    """A torque about z that follows a demand late, and is cut off at a limit."""

    time_constant = odyn.param("s", above=0, doc="How late.")
    limit = odyn.param("N m", above=0, doc="Largest torque.")
    demand = odyn.signal("N m", default=0, doc="The torque that is asked for.")
    torque = odyn.state("N m", doc="The torque that there is.")

    def rates(self, at: odyn.Motion) -> dict[str, odyn.Number]:
        return {"torque": (odyn.clip(self.demand, -self.limit, self.limit) - self.torque) / self.time_constant}

    def wrench(self, at: odyn.Motion, out: odyn.Loads) -> None:
        out.torque_pair(0, 1, at[0].z * self.torque)

    @odyn.check("N m")
    def reserve(self, at: odyn.Motion) -> odyn.Number:
        """is asked for more than its limit"""
        return self.limit - abs(self.demand)


@odyn.control()
class SpeedController:
    """Torque for a speed that is to be held: samples, and remembers the sum of errors."""

    speed = odyn.signal("rad/s", doc="The speed that there is.")
    target = odyn.param("rad/s", doc="The speed that is to be.")
    gain = odyn.param("N m s/rad", doc="Torque per error.")
    integral = odyn.param("N m/rad", default=0, doc="Torque per sum of errors over time.")
    period = odyn.param("s", above=0, doc="Time between two samples.")
    held = odyn.memory()
    total = odyn.memory()

    def sample_period(self) -> odyn.Number:
        return self.period

    def next_memory(self, at: odyn.Motion) -> dict[str, odyn.Number]:
        error = self.target - self.speed
        total = self.total + error * self.period
        return {"held": self.gain * error + self.integral * total, "total": total}

    @odyn.channel("N m")
    def torque(self, at: odyn.Motion) -> odyn.Number:
        """the torque to be applied"""
        return self.held


ALL = [Rod, SpringDamper, Hinge, Floor, Flywheel, Motor, SpeedController]

if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    print(odyn.save(folder / "mechanics.odyn-element", ALL, about="elements written in Python"))
