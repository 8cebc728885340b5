/* Exact motion of a free rigid body: the C interface of frb.
 *
 *     frb_body body;
 *     double moments[3] = {0.6, 0.8, 1.0}, m[3] = {1.8, 0.4, -0.9}, q[4] = {1.0, 0.0, 0.0, 0.0};
 *     frb_body_from_moments(moments, &body);
 *     frb_flow(&body, 10.0, m, q);                  // m and q after ten units of time
 *
 * m is angular momentum in body axes, 3 doubles; q is attitude, a quaternion with its scalar first that takes body
 * axes to space, 4 doubles. Any consistent units. Angles are in rad.
 *
 * A body and a motion are plain values: copy them, put them into structs, free nothing. One that was never set is
 * refused.
 *
 * Every function but the last four returns a status, FRB_OK or why the input was refused; a refused state stays as it
 * was. A null pointer has the status of the argument that it stands for (q may be NULL: no attitude). Nothing prints
 * or stops. All functions may be called from several threads at once.
 *
 * ldb, ldm, ldq are strides in doubles, from one body, momentum or quaternion to the next, as in LAPACK: for an
 * array of structs the size of the struct over that of a double. Packed arrays (ldb FRB_BODY_DOUBLES or 0, ldm 3,
 * ldq 4) are the fastest.
 */
#ifndef FRB_H
#define FRB_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Sizes of the opaque types in doubles; the library does not compile with others. */
#define FRB_BODY_DOUBLES 39
#define FRB_MOTION_DOUBLES 69

typedef struct { double opaque[FRB_BODY_DOUBLES]; } frb_body;
typedef struct { double opaque[FRB_MOTION_DOUBLES]; } frb_motion;

/* What functions return; frb_status_message has a line for each. */
enum {
    FRB_OK = 0,
    FRB_BAD_MOMENTS = 1,
    FRB_BAD_TENSOR = 2,
    FRB_BAD_MOMENTUM = 3,
    FRB_BAD_ATTITUDE = 4,
    FRB_BAD_TIME = 5,
    FRB_BAD_COUNT = 6,
    FRB_BAD_OPTION = 7,
    FRB_BAD_TORQUE = 8,
    FRB_BAD_SCHEME = 9,
    FRB_NO_PERIOD = 10,
    FRB_LAPACK_FAILED = 11,
    FRB_STOPPED = 12,
    FRB_NOT_OFFERED = 13,
    FRB_TOO_ROUGH = 14
};

/* A body from its principal moments, in any order, or from its inertia tensor, 3 x 3, symmetric, about the centre of
 * mass or the fixed point; m and q are then in the axes of the tensor. A linear rotor has the moments I, I, 0. */
int frb_body_from_moments(const double moments[3], frb_body *body);
int frb_body_from_tensor(const double tensor[9], frb_body *body);

/* Moments of a body; axes (or NULL) is 3 x 3, row after row, with the principal axes as its columns. */
int frb_body_axes(const frb_body *body, double moments[3], double axes[9]);

/* Advances the state of one body by the time h of either sign, in place: exact at any h. */
int frb_flow(const frb_body *body, double h, double m[3], double q[4]);

/* Advances n bodies, in place. ldb = 0: all are *body; else body is an array. A body that is refused keeps its state,
 * the others go on, and the largest status comes back. */
int frb_flow_many(const frb_body *body, size_t ldb, double h, size_t n, double *m, size_t ldm, double *q, size_t ldq);

/* The same for one body, with its exact derivatives: transition is 6 x 6, row after row, by (m, theta), variations of the
 * attitude being rotation vectors in body axes; by_moments (or NULL) is 6 x 3, by the moments, their axes held. */
int frb_flow_tangent(const frb_body *body, double h, double m[3], double q[4], double transition[36],
                     double by_moments[18]);

/* One motion at many times: its constants, from the state at t = 0, then the state at n times of either sign. */
int frb_motion_start(const frb_body *body, const double m[3], const double q[4], frb_motion *motion);
int frb_motion_at(const frb_motion *motion, size_t n, const double *t, double *m, size_t ldm, double *q, size_t ldq);

/* Period of m (infinity where there is none) and the angle by which the body has then turned about the momentum
 * (NaN where there is none). Either pointer may be NULL. */
int frb_motion_period(const frb_motion *motion, double *period, double *precession);

/* A torque: tau in body axes, at the attitude q and the time t. It returns 0, or a status that ends the run; context is
 * what the caller of frb_integrate gave. */
typedef int (*frb_torque)(void *context, const double q[4], double t, double tau[3]);

/* Runs a body under a torque, in place: `steps` steps of size h by a splitting scheme of the library ("strang",
 * "srkn14", ...). t (or NULL) grows by steps*h. rests (or NULL) makes a compensated run, which costs twice the time
 * and keeps the energy to the last digits: 7 doubles, 0 at the start; to continue a run, pass them on unchanged. A run
 * in two calls ends with the same bits as a run in one call. q must be of norm one, to 1e-6. */
int frb_integrate(const frb_body *body, const char *scheme, frb_torque torque, void *context, double h, int64_t steps,
                  double m[3], double q[4], double *t, double rests[7]);

/* The same for a heavy top, V = force . Q centre: force in space, at the point centre of the body. */
int frb_integrate_top(const frb_body *body, const char *scheme, const double force[3], const double centre[3], double h,
                      int64_t steps, double m[3], double q[4], double *t, double rests[7]);

/* Text of a status, and the version of the library: as much as fits into text[size], with its ending null. Both
 * functions return the length of the whole text. */
size_t frb_status_message(int status, char *text, size_t size);
size_t frb_version(char *text, size_t size);

/* Sizes the library was built with: other than sizeof(frb_body) and sizeof(frb_motion), if this is the header of
 * another version. */
size_t frb_body_bytes(void);
size_t frb_motion_bytes(void);

#ifdef __cplusplus
}
#endif

#endif
