"""by_dlsym.py ODE LIBRARY FUNCTION

As programs in C#, in Python's ctypes and by JNI use ODE: no function is linked. Makes a space by FUNCTION of LIBRARY, puts three
touching spheres into it, and prints how many pairs there are."""
import ctypes
import sys

ode, library = map(ctypes.CDLL, sys.argv[1:3])
real = ctypes.c_double if ode.dCheckConfiguration(b"ODE_double_precision") else ctypes.c_float
ode.dInitODE2(0)
create = library[sys.argv[3]]
create.restype = ctypes.c_void_p
space = ctypes.c_void_p(create(None))
for _ in range(3):
    ode.dCreateSphere(space, real(1))
pairs = []
near = ctypes.CFUNCTYPE(None, *3 * [ctypes.c_void_p])(lambda _, a, b: pairs.append((a, b)))
ode.dSpaceCollide(space, None, near)
print("%d pairs" % len(pairs))
