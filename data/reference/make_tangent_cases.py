"""cases.txt -> tangent_cases.txt: group I m h | m q | J W mI wI (row by row) | sensitivities of J W mI wI (Frobenius).
usage: make_tangent_cases.py IN OUT [DIGITS]"""
import sys, mpmath as mp
from tangent_mp import step_tangent
def flat(A): return [x for r in A for x in r]
def fro(v): return mp.sqrt(sum(x*x for x in v))
src=sys.argv[1]; out=open(sys.argv[2],'w'); dps=int(sys.argv[3]) if len(sys.argv)>3 else 40
mp.mp.dps=dps
for line in open(src):
    if line.startswith('#') or not line.strip(): continue
    f=line.split(); g=f[0]
    try: x=[mp.mpf(float(v)) for v in f[1:8]]
    except ValueError: continue
    ev=lambda x: step_tangent(x[:3],x[3:6],(1,0,0,0),x[6],dps)
    t=ev(x); keys=('J','W','mI','wI'); S=dict.fromkeys(keys,mp.mpf(0))
    u=mp.mpf(2)**-53
    for k in range(7):
        if x[k]==0: continue
        z=list(x); z[k]=x[k]*(1+u); r=ev(z)
        for n in keys: S[n]+=fro([p-q for p,q in zip(flat(r[n]),flat(t[n]))])
    out.write(' '.join([g]+['%.17g'%float(v) for v in x]+[mp.nstr(v,22) for v in t['m']+t['q']]+[mp.nstr(v,22) for n in keys for v in flat(t[n])]+[mp.nstr(S[n],6) for n in keys])+'\n')
