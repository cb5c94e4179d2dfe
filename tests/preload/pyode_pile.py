#!/usr/bin/env python3
"""A pile of bodies by PyODE (Debian: python3-pyode), which opens ODE as a plug-in's dependency.

    pyode_pile.py hash|sap|quadtree|nested [bodies [frames]]

nested: a hash space of simple spaces of four bodies each. Prints the sum of all heights. Ends with
status 77 where there is no PyODE.
"""
import random
import sys

try:
    import ode
except ImportError:
    print("Skipped: no PyODE (Debian: python3-pyode)")
    sys.exit(77)


def make_space(kind):
    if kind == "sap":
        # The default order of PyODE 1.2.0 names a fourth axis, and pairs are missed.
        return ode.SAPSpace(None, "XZY")
    if kind == "quadtree":
        return ode.QuadTreeSpace((0, 0, 0), (60, 60, 60), 5)
    space = ode.HashSpace()
    if kind == "hash":
        space.setLevels(-2, 6)
        assert space.getLevels() == (-2, 6)
    return space


def near(state, a, b):
    if a.isSpace() or b.isSpace():
        ode.collide2(a, b, state, near)
        return
    world, contacts = state
    for contact in ode.collide(a, b):
        contact.setMu(0.5)
        ode.ContactJoint(world, contacts, contact).attach(a.getBody(), b.getBody())


def main():
    kind = sys.argv[1]
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 200
    frames = int(sys.argv[3]) if len(sys.argv) > 3 else 60
    scatter = random.Random(1)
    world = ode.World()
    world.setGravity((0, 0, -9.81))
    contacts = ode.JointGroup()
    space = make_space(kind)
    geoms = [ode.GeomPlane(space, (0, 0, 1), 0)]
    group = space
    groups = []
    side = max(2, round((count / 4) ** 0.5))
    for i in range(count):
        if kind == "nested" and i % 4 == 0:
            group = ode.SimpleSpace(space)
            groups.append(group)
        body = ode.Body(world)
        mass = ode.Mass()
        mass.setSphere(1, 0.5)
        body.setMass(mass)
        body.setPosition((20 + i % side + scatter.random() / 4, 20 + i // side % side + scatter.random() / 4,
                          1 + i // (side * side) * 1.1))
        geom = ode.GeomSphere(group, 0.5) if i % 2 else ode.GeomBox(group, (0.8, 0.8, 0.8))
        geom.setBody(body)
        geoms.append(geom)
    for _ in range(frames):
        space.collide((world, contacts), near)
        world.quickStep(0.01)
        contacts.empty()
        for member in groups:
            member.collide((world, contacts), near)
    print("%d bodies, sum of heights %.9f" % (count, sum(g.getBody().getPosition()[2] for g in geoms[1:])))


main()
