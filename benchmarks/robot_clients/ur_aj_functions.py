"""ur-aj: bare script lines on 30001, the state from 30003."""

import sys

import ur_aj

ur_aj.configure_robot(sys.argv[1])
ur_aj.jointangle(1)
ur_aj.jointupdate(1, 20.0, 2.0)
assert abs(ur_aj.getjoints()[0] - 20.0) < 0.01
before = ur_aj.getpose()
ur_aj.moveLoffset(0, 0, 20.0, speed=0.5)
travelled = sum((a - b) ** 2 for a, b in zip(ur_aj.getpose()[:3], before[:3], strict=True)) ** 0.5
assert abs(travelled - 20.0) < 0.1, travelled
ur_aj.digitalout(2, True)
ur_aj.analogout(0, 0.5)
