/* Wrong calls of all kinds, to be run under valgrind: each is refused by a status, and only memory of the caller is read
 * or written. */
#include <frb.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int failures, calls;

static void is(const char *what, int got, int expected)
{
    calls++;
    if (got == expected) return;
    failures++;
    printf("FAILED %s: %d, not %d\n", what, got, expected);
}

static int no_torque(void *context, const double q[4], double t, double tau[3])
{
    (void)q;
    (void)t;
    tau[0] = tau[1] = tau[2] = 0.0;
    return *(int *)context;
}

int main(void)
{
    enum { n = 70 };
    const double moments[3] = {0.6, 0.8, 1.0}, bad[3] = {0.6, -0.8, 1.0}, up[3] = {0.0, 0.0, 1.0};
    const size_t huge = (size_t)-1, wrong[4] = {0, 1, 2, (size_t)-3};
    struct { double m[3]; frb_body body; double q[4]; } one[n];
    const size_t ld = sizeof one[0]/sizeof(double);
    frb_body body, junk;
    frb_motion motion, junk_motion;
    double state[36], m[3] = {1.8, 0.4, -0.9}, q[4] = {1.0, 0.0, 0.0, 0.0}, t = 1.0, axes[9], nan = 0.0;
    double *few_m = malloc(3*n*sizeof *few_m), *few_q = malloc(4*n*sizeof *few_q);
    unsigned char *bytes = (unsigned char *)&junk, *motion_bytes = (unsigned char *)&junk_motion;
    unsigned seed = 1;
    char text[8];
    int i, k, code = 0;

    nan = nan/nan;
    is("body", frb_body_from_moments(moments, &body), FRB_OK);
    is("no moments", frb_body_from_moments(NULL, &body), FRB_BAD_MOMENTS);
    is("no body", frb_body_from_moments(moments, NULL), FRB_BAD_MOMENTS);
    is("bad moments", frb_body_from_moments(bad, &junk), FRB_BAD_MOMENTS);
    is("refused body", frb_flow(&junk, 1.0, m, q), FRB_BAD_MOMENTS);
    is("no tensor", frb_body_from_tensor(NULL, &body), FRB_BAD_TENSOR);
    is("no body", frb_body_from_tensor(axes, NULL), FRB_BAD_TENSOR);
    is("no body", frb_body_axes(NULL, m, axes), FRB_BAD_MOMENTS);
    is("no moments", frb_body_axes(&body, NULL, axes), FRB_BAD_MOMENTS);
    is("no axes", frb_body_axes(&body, axes, NULL), FRB_OK);
    is("flow of no body", frb_flow(NULL, 1.0, m, q), FRB_BAD_MOMENTS);
    is("flow of no momentum", frb_flow(&body, 1.0, NULL, q), FRB_BAD_MOMENTUM);
    is("flow of no attitude", frb_flow(&body, 1.0, m, NULL), FRB_OK);
    is("time is not a number", frb_flow(&body, nan, m, q), FRB_BAD_TIME);

    is("tangent of no body", frb_flow_tangent(NULL, 1.0, m, q, state, NULL), FRB_BAD_MOMENTS);
    is("tangent of no momentum", frb_flow_tangent(&body, 1.0, NULL, q, state, NULL), FRB_BAD_MOMENTUM);
    is("tangent of no attitude", frb_flow_tangent(&body, 1.0, m, NULL, state, NULL), FRB_BAD_ATTITUDE);
    is("tangent to nowhere", frb_flow_tangent(&body, 1.0, m, q, NULL, NULL), FRB_BAD_COUNT);
    is("tangent", frb_flow_tangent(&body, 1.0, m, q, state, NULL), FRB_OK);
    is("n = 0", frb_flow_many(&body, 0, 1.0, 0, NULL, 3, NULL, 0), FRB_OK);
    is("many of no body", frb_flow_many(NULL, 0, 1.0, 1, m, 3, q, 4), FRB_BAD_MOMENTS);
    is("many of no momentum", frb_flow_many(&body, 0, 1.0, 1, NULL, 3, q, 4), FRB_BAD_MOMENTUM);
    is("huge n", frb_flow_many(&body, 0, 1.0, huge, m, 3, q, 4), FRB_BAD_COUNT);
    is("large n", frb_flow_many(&body, 0, 1.0, (size_t)1 << 31, m, 3, q, 4), FRB_BAD_COUNT);
    for (i = 0; i < 4; i++) {
        is("ldm", frb_flow_many(&body, 0, 1.0, 1, m, wrong[i], q, 4), FRB_BAD_COUNT);
        is("ldq", frb_flow_many(&body, 0, 1.0, 1, m, 3, q, wrong[i]), FRB_BAD_COUNT);
        if (i > 0) is("ldb", frb_flow_many(&body, wrong[i], 1.0, 1, m, 3, q, 4), FRB_BAD_COUNT);
    }

    /* An array of structs: the last one ends where memory ends. */
    for (i = 0; i < n; i++) {
        memcpy(one[i].m, m, sizeof m);
        memcpy(one[i].q, q, sizeof q);
        one[i].body = body;
    }
    is("structs", frb_flow_many(&one->body, ld, 1.0, n, one->m, ld, one->q, ld), FRB_OK);
    is("structs without attitude", frb_flow_many(&one->body, ld, 1.0, n, one->m, ld, NULL, 0), FRB_OK);
    is("one body", frb_flow_many(&body, 0, 1.0, n, one->m, ld, one->q, ld), FRB_OK);
    for (i = 0; i < n; i++) {
        memcpy(few_m + 3*i, one[i].m, sizeof m);
        memcpy(few_q + 4*i, one[i].q, sizeof q);
    }
    is("packed", frb_flow_many(&body, 0, 1.0, n, few_m, 3, few_q, 4), FRB_OK);
    is("strided", frb_flow_many(&body, 0, 1.0, n, one->m, ld, one->q, ld), FRB_OK);
    for (i = 0; i < n; i++) {
        is("same momentum", memcmp(few_m + 3*i, one[i].m, sizeof m), 0);
        is("same attitude", memcmp(few_q + 4*i, one[i].q, sizeof q), 0);
    }
    /* One that was never made among others: it stays, the others go on. */
    memset(&one[5].body, 0, sizeof body);
    memcpy(axes, one[5].m, sizeof m);
    is("one unmade", frb_flow_many(&one->body, ld, 1.0, n, one->m, ld, one->q, ld), FRB_BAD_MOMENTS);
    is("it stays", memcmp(axes, one[5].m, sizeof m), 0);
    is("the next one moves", memcmp(few_m + 3*6, one[6].m, sizeof m) == 0, 0);

    is("motion", frb_motion_start(&body, m, q, &motion), FRB_OK);
    is("motion of no body", frb_motion_start(NULL, m, q, &junk_motion), FRB_BAD_MOMENTS);
    is("refused motion", frb_motion_at(&junk_motion, 1, &t, m, 3, q, 4), FRB_BAD_MOMENTS);
    is("motion of no m", frb_motion_start(&body, NULL, q, &junk_motion), FRB_BAD_MOMENTUM);
    is("motion of no q", frb_motion_start(&body, m, NULL, &junk_motion), FRB_BAD_ATTITUDE);
    is("nowhere", frb_motion_start(&body, m, q, NULL), FRB_BAD_COUNT);
    is("no motion", frb_motion_at(NULL, 1, &t, m, 3, q, 4), FRB_BAD_MOMENTS);
    is("no motion", frb_motion_period(NULL, &t, &t), FRB_BAD_MOMENTS);
    is("no numbers", frb_motion_period(&motion, NULL, NULL), FRB_OK);
    is("no times", frb_motion_at(&motion, 1, NULL, m, 3, q, 4), FRB_BAD_TIME);
    is("no m", frb_motion_at(&motion, 1, &t, NULL, 3, q, 4), FRB_BAD_MOMENTUM);
    is("no q", frb_motion_at(&motion, 1, &t, m, 3, NULL, 0), FRB_OK);
    is("0 times", frb_motion_at(&motion, 0, NULL, NULL, 3, NULL, 0), FRB_OK);
    is("huge n", frb_motion_at(&motion, huge, &t, m, 3, q, 4), FRB_BAD_COUNT);
    is("bad ldm", frb_motion_at(&motion, 1, &t, m, 2, q, 4), FRB_BAD_COUNT);
    is("bad ldq", frb_motion_at(&motion, 1, &t, m, 3, q, 3), FRB_BAD_COUNT);

    is("run", frb_integrate(&body, "strang", no_torque, &code, 0.1, 5, m, q, NULL, NULL), FRB_OK);
    code = 77;
    is("torque refuses", frb_integrate(&body, "strang", no_torque, &code, 0.1, 5, m, q, NULL, NULL), 77);
    is("no torque", frb_integrate(&body, "strang", NULL, NULL, 0.1, 5, m, q, NULL, NULL), FRB_BAD_TORQUE);
    is("no scheme", frb_integrate_top(&body, NULL, up, up, 0.1, 5, m, q, NULL, NULL), FRB_BAD_OPTION);
    is("unknown scheme", frb_integrate_top(&body, "rk4", up, up, 0.1, 5, m, q, NULL, NULL), FRB_BAD_OPTION);
    is("no force", frb_integrate_top(&body, "strang", NULL, up, 0.1, 5, m, q, NULL, NULL), FRB_BAD_TORQUE);
    is("top of no body", frb_integrate_top(NULL, "strang", up, up, 0.1, 5, m, q, NULL, NULL), FRB_BAD_MOMENTS);
    is("steps < 0", frb_integrate_top(&body, "strang", up, up, 0.1, -1, m, q, NULL, NULL), FRB_BAD_COUNT);

    /* Memory of all sorts in the place of a body and of a motion. */
    for (k = 0; k < 1000; k++) {
        for (i = 0; i < (int)sizeof junk_motion; i++) {
            seed = seed*1664525u + 1013904223u;
            motion_bytes[i] = k < 256 ? (unsigned char)k : (unsigned char)(seed >> 24);
        }
        memcpy(bytes, motion_bytes, sizeof junk);
        calls++;
        if (frb_flow(&junk, 1.0, m, q) == FRB_OK || frb_flow_tangent(&junk, 1.0, m, q, state, NULL) == FRB_OK ||
            frb_motion_at(&junk_motion, 1, &t, m, 3, q, 4) == FRB_OK ||
            frb_flow_many(&junk, 0, 1.0, 1, m, 3, q, 4) == FRB_OK ||
            frb_integrate_top(&junk, "strang", up, up, 0.1, 1, m, q, NULL, NULL) == FRB_OK) {
            failures++;
            printf("FAILED junk %d\n", k);
        }
    }

    is("nowhere to write", (int)frb_version(NULL, 100), (int)frb_version(text, sizeof text));
    is("no room", frb_status_message(FRB_BAD_TIME, text, 0) > 8, 1);
    frb_status_message(FRB_BAD_TIME, text, sizeof text);
    is("as much as fits", (int)strlen(text), 7);
    free(few_m);
    free(few_q);
    printf("%d calls, %d failed\n", calls, failures);
    return failures > 0;
}
