!> Bodies under torque: the free flow (drift) and the torque (kick) in turns, H = T + V.
!>
!> One step of an ABA scheme is drift(a1 h) kick(b1 h) drift(a2 h) ... drift(a1 h), section 4.3 and the
!> appendix of the paper; time passes with the drift. `splitting_plan` lists the drifts and kicks of a step,
!> for `integrate` and for a user's own loops.
!>
!> When to use which method:
!>
!> | wanted | use |
!> |--------|------|
!> | a state at a time, to an accuracy, up to some 10 000 turns | `extrapolate` (frb_extrapolation) |
!> | long runs and many bodies, symplectic and reversible | `fg6a` or `srkn14`, from 1e-9 on `fg8` |
!> | the same with a small torque, |V| much smaller than T | `fg6b` |
!> | costly torques, and a scene without `torque_change` | `srkn14`; for a small torque `aba864`, `aba1064` |
!> | last digits, very long runs | the same, `compensated` |
!> | low accuracy, molecular dynamics with smooth forces | `srkn6`, `fg4`; with kinked forces `strang` |
!>
!> Time [us] to an error of the attitude of 1e-9 at T = 100, one core of an EPYC at 3 GHz, AVX2:
!>
!> | top | extrapolate | fg6a | fg6b | fg8 | srkn14 | aba864 | DOP853 on m and q |
!> |-----|-------------|------|------|-----|--------|--------|-------------------|
!> | Hairer-Vilmart, strong torque | 133 | 549 | 824 | 570 | 733 | 774 | 397 |
!> | the paper's, weak torque | 17 | 64 | 43 | 73 | 74 | 56 | 67 |
!>
!> The chart program's `ratios` makes this table, for other errors too, splittings with `joined` drifts;
!> `heavy-top` makes the pictures, for T = 10 and 10 000 too.
module frb_splitting
    use frb_free_flow, only: rigid_body
    use frb_kinds, only: wp
    use frb_schemes, only: splitting_scheme
    use frb_splitting_many, only: integrate_group
    use frb_splitting_one, only: integrate_body
    use frb_torque, only: body_scene, body_observer, body_drift, group_scene, group_observer
    use, intrinsic :: iso_fortran_env, only: int32, int64
    implicit none
    private

    public :: integrate

    !> Integrates one body, or n bodies that interact, over `nsteps` steps of size `h`, in place:
    !> `call integrate(body, scheme, scene, h, nsteps, m, q, observer, every, t, drift, compensated, rests,
    !> joined, stat)`.
    !>
    !> For n bodies m is (3, n), q is (4, n), the body a scalar or body(n), scene and observer those of a
    !> group. `nsteps` is an integer of 32 or 64 bits; steps are counted in 64. Refused with `stat`, the state
    !> and t untouched: a body or scheme that could not be made (their own code); h zero, h or t not finite,
    !> nsteps*h or t beyond 1e301, or h beyond 1e100 with modified kicks (`status_bad_time`); nsteps < 0,
    !> every < 1 or sizes that differ (`status_bad_count`); m not finite (`status_bad_momentum`); q not finite
    !> or its norm more than 1e-6 off one (`status_bad_attitude`). The torque receives q with this norm, which
    !> the run keeps: it should be one to the accuracy wanted. A run that ends early leaves m, q and t of the
    !> last whole step. It ends by the code that a torque or drift returns; a torque that is not finite, or so
    !> large that m overflows (`status_bad_torque`); an observer (`status_stopped`; without `stat` the call
    !> then returns, while every other code stops the program). Where many processes share a scene, they agree
    !> upon the code first: see `agree` in frb_torque.
    !>
    !> Exact restart: the state after a step depends on m, q, t and h before it only. A run that is stopped,
    !> by its observer or its number of steps, and continued from the returned m, q and t, ends with the same
    !> bits as a run in one call; observers do not change a run. A compensated run needs `rests` as well: (7),
    !> or (7, n) for a group, the rounding errors of m (1:3) and q (4:7), zero at the start. For exact
    !> restarts all steps are whole: a scheme that opens and closes with a drift (ABA) makes both drifts, one
    !> more than a chain of steps needs. `joined` makes the two drifts between steps as one where no state is
    !> shown: then the bits depend on which states are shown. It pays where torques are cheap.
    !>
    !> `compensated` carries the rounding error of every update of m and q over to the next one, and keeps |m|
    !> and the energy in every drift. It takes 2.2 to 2.3 times as long and pays in long runs: there energy,
    !> momentum and norm stay within a few units of the last digit, where errors of a plain run grow with the
    !> square root of the number of steps.
    !>
    !> Accuracy: energy, 0.21, of the paper's heavy top within 1e-13 over 1e5 steps of 0.5; checked by
    !> `splitting: energy-of-the-papers-top-stays-within-1e-13`; compensated, of the Hairer-Vilmart top within
    !> 32 epsilon over 20 000 steps of 0.01; checked by `splitting: compensated-energy-does-not-wander`.
    !>
    !> Reversal: 10 000 steps and as many of -h return the start to 1e-12 in a compensated run up to h = 0.01
    !> on the Hairer-Vilmart tops (1e-13 at most) and on the paper's up to h = 0.5, T = 5000 (2e-13), in
    !> a plain run up to h = 0.001 and 0.01; checked by `splitting: ...-there-and-back-return-the-start` and
    !> `splitting: ...-papers-long-run-there-and-back-returns-the-start`. A small change of the start grows in
    !> proportion to the time, 0.2 t on the paper's top, 0.8 t and 2 t on the other two, and rounding errors
    !> grow with it. Without torque only errors of |m| and of the energy grow; they are corrected after each
    !> drift, the energy only if the drift keeps it to rounding. Under a torque as strong as on the
    !> Hairer-Vilmart tops the last digits of the torque and of the turn in each drift count as well: with h =
    !> 0.1, T = 1000 the distance is 1e-13 to 2.5e-12 on the asymmetric one and 2e-13 to 4e-12 on the flat
    !> one, plain 2e-12 to 1e-10. The chart program's `torque` makes the table.
    interface integrate
        procedure integrate_body
        procedure integrate_alike
        procedure integrate_group
        procedure integrate_body_int32
        procedure integrate_alike_int32
        procedure integrate_group_int32
    end interface integrate

contains

    !> n bodies that are alike.
    subroutine integrate_alike(body, scheme, scene, h, nsteps, m, q, observer, every, t, drift, &
                      compensated, rests, joined, stat)
        type(rigid_body), intent(in) :: body
        integer(int64), intent(in) :: nsteps
        include 'group_arguments.inc'

        call integrate_group([body], scheme, scene, h, nsteps, m, q, observer, every, t, drift, &
                      compensated, rests, joined, stat)
    end subroutine integrate_alike

    !> One body, steps counted by a shorter integer.
    subroutine integrate_body_int32(body, scheme, scene, h, nsteps, m, q, observer, every, t, drift, &
                      compensated, rests, joined, stat)
        type(rigid_body), intent(in) :: body
        type(splitting_scheme), intent(in) :: scheme
        class(body_scene), intent(inout) :: scene
        real(wp), intent(in) :: h
        integer(int32), intent(in) :: nsteps
        real(wp), intent(inout) :: m(3), q(4)
        class(body_observer), intent(inout), optional :: observer
        integer, intent(in), optional :: every
        real(wp), intent(inout), optional :: t
        class(body_drift), intent(in), optional :: drift
        logical, intent(in), optional :: compensated
        real(wp), intent(inout), optional :: rests(7)
        logical, intent(in), optional :: joined
        integer, intent(out), optional :: stat

        call integrate_body(body, scheme, scene, h, int(nsteps, int64), m, q, observer, every, t, drift, &
                      compensated, rests, joined, stat)
    end subroutine integrate_body_int32

    !> n bodies that are alike, steps counted by a shorter integer.
    subroutine integrate_alike_int32(body, scheme, scene, h, nsteps, m, q, observer, every, t, drift, &
                      compensated, rests, joined, stat)
        type(rigid_body), intent(in) :: body
        integer(int32), intent(in) :: nsteps
        include 'group_arguments.inc'

        call integrate_group([body], scheme, scene, h, int(nsteps, int64), m, q, observer, every, t, drift, &
                      compensated, rests, joined, stat)
    end subroutine integrate_alike_int32

    !> n bodies, steps counted by a shorter integer.
    subroutine integrate_group_int32(body, scheme, scene, h, nsteps, m, q, observer, every, t, drift, &
                      compensated, rests, joined, stat)
        type(rigid_body), intent(in) :: body(:)
        integer(int32), intent(in) :: nsteps
        include 'group_arguments.inc'

        call integrate_group(body, scheme, scene, h, int(nsteps, int64), m, q, observer, every, t, drift, &
                      compensated, rests, joined, stat)
    end subroutine integrate_group_int32

end module frb_splitting
