/* Results of the installed library in a C or C++ program: their bits, one number a line; client.f90 prints the same
 * lines. */
#include <frb.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void say(const char *what, const double *x, int n)
{
    int i;
    for (i = 0; i < n; i++) {
        uint64_t bits;
        memcpy(&bits, x + i, sizeof bits);
        printf("%s %08lX%08lX\n", what, (unsigned long)(bits >> 32), (unsigned long)(bits & 0xFFFFFFFF));
    }
}

static void check(int status)
{
    char text[100];
    if (status == FRB_OK) return;
    frb_status_message(status, text, sizeof text);
    puts(text);
    exit(1);
}

int main(void)
{
    enum { n = 40 };
    const double moments[3] = {0.6, 0.8, 1.0}, start[3] = {1.8, 0.4, -0.9}, none[4] = {1.0, 0.0, 0.0, 0.0};
    const double tensor[9] = {0.9, 0.1, 0.05, 0.1, 0.8, -0.02, 0.05, -0.02, 0.7};
    const double up[3] = {0.0, 0.0, 1.0}, t[2] = {-3.7, 1000.0};
    frb_body body, turned, bodies[n];
    frb_motion motion;
    double m[3], q[4], transition[36], by_moments[18], many_m[n][3], many_q[n][4], period, precession, time = 0.0;
    int i;

    if (frb_body_bytes() != sizeof body || frb_motion_bytes() != sizeof motion) {
        puts("frb.h is that of another library");
        return 1;
    }
    check(frb_body_from_moments(moments, &body));
    check(frb_body_from_tensor(tensor, &turned));
    memcpy(m, start, sizeof m);
    memcpy(q, none, sizeof q);
    check(frb_flow(&body, 10.0, m, q));
    say("flow", m, 3);
    say("flow", q, 4);
    check(frb_flow(&turned, -0.3, m, NULL));
    say("momentum", m, 3);
    for (i = 0; i < n; i++) {
        bodies[i] = i % 3 ? body : turned;
        memcpy(many_m[i], start, sizeof m);
        memcpy(many_q[i], none, sizeof q);
        many_m[i][0] += 0.1*i;
    }
    check(frb_flow_many(bodies, FRB_BODY_DOUBLES, 0.25, n, many_m[0], 3, many_q[0], 4));
    check(frb_flow_many(&body, 0, 0.25, n, many_m[0], 3, many_q[0], 4));
    say("batch", many_m[0], 3*n);
    say("batch", many_q[0], 4*n);
    check(frb_motion_start(&body, start, none, &motion));
    check(frb_motion_period(&motion, &period, &precession));
    check(frb_motion_at(&motion, 2, t, many_m[0], 3, many_q[0], 4));
    say("period", &period, 1);
    say("precession", &precession, 1);
    say("motion", many_m[0], 6);
    say("motion", many_q[0], 8);
    check(frb_integrate_top(&body, "srkn14", up, up, 0.1, 100, m, q, &time, NULL));
    say("top", m, 3);
    say("top", q, 4);
    check(frb_flow_tangent(&turned, 2.0, m, q, transition, by_moments));
    say("tangent", m, 3);
    say("tangent", q, 4);
    say("tangent", transition, 36);
    say("tangent", by_moments, 18);
    return 0;
}
