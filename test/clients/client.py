"""What ctypes gets from the installed library: the first lines of what client.c prints."""
import ctypes
import struct
import sys

frb = ctypes.CDLL(sys.argv[1])
frb.frb_body_bytes.restype = ctypes.c_size_t
body = ctypes.create_string_buffer(frb.frb_body_bytes())
m = (ctypes.c_double*3)(1.8, 0.4, -0.9)
q = (ctypes.c_double*4)(1.0, 0.0, 0.0, 0.0)
if frb.frb_body_from_moments((ctypes.c_double*3)(0.6, 0.8, 1.0), body) != 0:
    sys.exit(1)
if frb.frb_flow(body, ctypes.c_double(10.0), m, q) != 0:
    sys.exit(1)
for number in [*m, *q]:
    print('flow', struct.pack('>d', number).hex().upper())
