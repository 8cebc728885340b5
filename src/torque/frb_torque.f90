!> Types that a user extends to put torque on a body: the scene (gives the torque), the observer (watches a
!> run) and the drift (moves the free body in the place of the free flow). Parameters are components of these
!> types, so nothing is global.
!>
!> Scenes and observers may count, keep lists and buffers, communicate with other processes: `self` is
!> intent(inout) and no procedure has to be pure; pure procedures are allowed too.
!>
!> Torque and momentum are in the body frame: m' = m x I^-1 m + tau(q, t), q' = q (0, I^-1 m)/2. A torque from
!> a potential V(q) is tau = sum over body vectors u = Q^T u0 that V depends on of u x dV/du.
module frb_torque
    use frb_free_flow, only: rigid_body
    use frb_kinds, only: wp
    use frb_modified_kicks, only: gradient_torque
    use frb_status, only: status_ok, status_not_offered
    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: body_scene, group_scene, body_observer, group_observer, body_drift, scene_lanes, &
        torque_lane_by_lane, one_after_the_other

    integer, parameter :: scene_lanes = 8     !! number of attitudes in one call of `torque_lanes`

    !> The torque on one body. Extend it with the scene's parameters, give `torque`, and give `potential` too
    !> where there is one and the energy is to be watched.
    type, abstract :: body_scene
    contains
        procedure(torque_on_body), deferred :: torque    !! the torque
        procedure :: torque_change => body_change_unknown    !! its derivative, for modified kicks
        procedure :: torque_and_gradient => one_after_the_other    !! torque and g of a modified kick at once
        procedure :: torque_lanes => torque_lane_by_lane    !! the torque in lanes, for `extrapolate`
        procedure :: potential => body_potential_unknown    !! the potential, where there is one
        procedure :: agree => body_alone    !! hook of runs on many processes
    end type body_scene

    !> The torques on n bodies that interact: each torque depends on all attitudes. The scene itself has the
    !> centres of the bodies: as components if they are fixed, as functions of t if they move.
    type, abstract :: group_scene
    contains
        procedure(torques_on_group), deferred :: torques    !! the torques
        procedure :: torques_change => group_change_unknown    !! their derivative, for modified kicks
        procedure :: potential => group_potential_unknown    !! the potential, where there is one
        procedure :: agree => group_alone    !! hook of runs on many processes
    end type group_scene

    !> Watches a run of one body.
    type, abstract :: body_observer
    contains
        procedure(observe_body), deferred :: observe    !! sees the state
    end type body_observer

    !> Watches a run of n bodies.
    type, abstract :: group_observer
    contains
        procedure(observe_group), deferred :: observe    !! sees the states
    end type group_observer

    !> A flow of the free body, or an approximation of it, to take the place of `free_flow`.
    type, abstract :: body_drift
    contains
        procedure(advance_body), deferred :: advance    !! moves the body
    end type body_drift

    !> The interfaces of the procedures of a scene, an observer and a drift.
    abstract interface
        !> The torque at attitude q and time t.
        subroutine torque_on_body(self, q, t, tau, stat)
            import :: body_scene, wp
            implicit none
            class(body_scene), intent(inout) :: self
            real(wp), intent(in) :: q(4)        !! attitude, unit quaternion, body to space
            real(wp), intent(in) :: t           !! time
            real(wp), intent(out) :: tau(3)     !! torque, body frame
            integer, intent(out) :: stat        !! `status_ok`, or a code of any kind that ends the run
        end subroutine torque_on_body

        !> The torques at the attitudes q and time t.
        subroutine torques_on_group(self, q, t, tau, stat)
            import :: group_scene, wp
            implicit none
            class(group_scene), intent(inout) :: self
            real(wp), contiguous, intent(in) :: q(:, :)     !! attitudes (4, n), unit quaternions
            real(wp), intent(in) :: t                       !! time
            real(wp), contiguous, intent(out) :: tau(:, :)  !! torques (3, n), each in its body's frame
            integer, intent(out) :: stat                    !! `status_ok`, or a code that ends the run
        end subroutine torques_on_group

        !> Called with the state after `step` steps, at time t.
        subroutine observe_body(self, step, t, m, q, stop)
            import :: body_observer, int64, wp
            implicit none
            class(body_observer), intent(inout) :: self
            integer(int64), intent(in) :: step  !! steps done, 0 at the start
            real(wp), intent(in) :: t           !! time
            real(wp), intent(in) :: m(3)        !! angular momentum, body frame
            real(wp), intent(in) :: q(4)        !! attitude
            logical, intent(inout) :: stop      !! comes as .false.; .true. ends the run with this state
        end subroutine observe_body

        !> Called with the state after `step` steps, at time t.
        subroutine observe_group(self, step, t, m, q, stop)
            import :: group_observer, int64, wp
            implicit none
            class(group_observer), intent(inout) :: self
            integer(int64), intent(in) :: step              !! steps done, 0 at the start
            real(wp), intent(in) :: t                       !! time
            real(wp), contiguous, intent(in) :: m(:, :)     !! angular momenta (3, n), body frames
            real(wp), contiguous, intent(in) :: q(:, :)     !! attitudes (4, n)
            logical, intent(inout) :: stop                  !! comes as .false.; .true. ends the run here
        end subroutine observe_group

        !> Moves the free body by h in time, in place.
        subroutine advance_body(self, body, h, m, q, stat)
            import :: body_drift, rigid_body, wp
            implicit none
            class(body_drift), intent(in) :: self
            type(rigid_body), intent(in) :: body
            real(wp), intent(in) :: h           !! of either sign
            real(wp), intent(inout) :: m(3)     !! angular momentum, body frame
            real(wp), intent(inout) :: q(4)     !! attitude
            integer, intent(out) :: stat        !! `status_ok`, or a code that ends the run
        end subroutine advance_body
    end interface

contains

    !> The torques at several attitudes and times, for `extrapolate`: a scene that computes them in a loop
    !> over the lanes, which the compiler turns into vectors, is faster than single calls. The default makes
    !> single calls; lanes 5 to 8 that repeat lanes 1 to 4 need no calls.
    subroutine torque_lane_by_lane(self, q, t, tau, stat)
        class(body_scene), intent(inout) :: self
        real(wp), intent(in) :: q(scene_lanes, 4)         !! attitudes: a column for each component
        real(wp), intent(in) :: t(scene_lanes)            !! their times
        real(wp), intent(out) :: tau(scene_lanes, 3)      !! torques, body frame
        integer, intent(out) :: stat                !! `status_ok`, or a code that ends the run
        integer, parameter :: half = scene_lanes/2
        real(wp) :: attitude(4), one(3)
        integer :: l, e, last, code

        stat = status_ok
        last = scene_lanes
        if (second_half_repeats(q, t)) last = half
        do l = 1, last
            attitude = q(l, :)
            call self%torque(attitude, t(l), one, code)
            do e = 1, 3
                tau(l, e) = one(e)
            end do
            if (stat == status_ok) stat = code
        end do
        if (last == half) tau(half + 1:, :) = tau(:half, :)
    end subroutine torque_lane_by_lane

    !> Whether lanes 5 to 8 repeat lanes 1 to 4 to the bit, NaN included.
    pure function second_half_repeats(q, t) result(repeats)
        real(wp), intent(in) :: q(scene_lanes, 4), t(scene_lanes)
        logical :: repeats
        integer, parameter :: half = scene_lanes/2
        integer(int64) :: differences(half)
        integer :: l

        do l = 1, half
            differences(l) = ior(ior(ior(difference(q(l, 1), q(half + l, 1)), &
                                         difference(q(l, 2), q(half + l, 2))), &
                                     ior(difference(q(l, 3), q(half + l, 3)), &
                                         difference(q(l, 4), q(half + l, 4)))), &
                                 difference(t(l), t(half + l)))
        end do
        repeats = ior(ior(differences(1), differences(2)), ior(differences(3), differences(4))) == 0
    end function second_half_repeats

    !> Bits in which two numbers differ.
    pure function difference(x, y) result(bits)
        real(wp), intent(in) :: x, y
        integer(int64) :: bits

        bits = ieor(transfer(x, 0_int64), transfer(y, 0_int64))
    end function difference

    !> The change of the torque as the body turns: change = d/de tau(q exp(e n), t) at e = 0, body frame, for
    !> schemes with a modified kick (frb_modified_kicks); stat, `status_ok` or a code that ends the run. By
    !> default `status_not_offered`: the schemes then use displaced torques.
    subroutine body_change_unknown(self, q, t, n, change, stat)
        class(body_scene), intent(inout) :: self
        real(wp), intent(in) :: q(4), t
        real(wp), intent(in) :: n(3)            !! vector of the turn, body frame
        real(wp), intent(out) :: change(3)
        integer, intent(out) :: stat

        associate (unused_self => self, unused_q => q, unused_t => t, unused_n => n)
        end associate
        change = 0.0_wp
        stat = status_not_offered
    end subroutine body_change_unknown

    !> The torque and g = 2 (D_n tau + n x tau), n = I^-1 tau, of a modified kick (frb_modified_kicks) for a
    !> scene that shares work between them; response is I^-1 in the body frame. By default from `torque` and
    !> `torque_change`. stat: `status_not_offered` where there is no `torque_change`; tau is set then too.
    subroutine one_after_the_other(self, q, t, response, tau, g, stat)
        class(body_scene), intent(inout) :: self
        real(wp), intent(in) :: q(4), t, response(3, 3)
        real(wp), intent(out) :: tau(3), g(3)
        integer, intent(out) :: stat
        real(wp) :: n(3), change(3)

        g = 0.0_wp
        call self%torque(q, t, tau, stat)
        if (stat /= status_ok) return
        n = matmul(response, tau)
        call self%torque_change(q, t, n, change, stat)
        if (stat == status_ok) g = gradient_torque(n, tau, change)
    end subroutine one_after_the_other

    !> `torque_change` for a group, all bodies turning at a time: n and change are (3, n).
    subroutine group_change_unknown(self, q, t, n, change, stat)
        class(group_scene), intent(inout) :: self
        real(wp), contiguous, intent(in) :: q(:, :)
        real(wp), intent(in) :: t
        real(wp), contiguous, intent(in) :: n(:, :)
        real(wp), contiguous, intent(out) :: change(:, :)
        integer, intent(out) :: stat

        associate (unused_self => self, unused_q => q, unused_t => t, unused_n => n)
        end associate
        change = 0.0_wp
        stat = status_not_offered
    end subroutine group_change_unknown

    !> The potential energy at attitude q and time t: v, and stat, `status_ok` or a code that says why there
    !> is none. By default NaN: this scene gives no potential.
    subroutine body_potential_unknown(self, q, t, v, stat)
        class(body_scene), intent(inout) :: self
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: v
        integer, intent(out) :: stat

        associate (unused_self => self, unused_q => q, unused_t => t)
        end associate
        call no_potential(v, stat)
    end subroutine body_potential_unknown

    !> The potential energy of all at the attitudes q (4, n) and time t, as for one body.
    subroutine group_potential_unknown(self, q, t, v, stat)
        class(group_scene), intent(inout) :: self
        real(wp), contiguous, intent(in) :: q(:, :)
        real(wp), intent(in) :: t
        real(wp), intent(out) :: v
        integer, intent(out) :: stat

        associate (unused_self => self, unused_q => q, unused_t => t)
        end associate
        call no_potential(v, stat)
    end subroutine group_potential_unknown

    !> What a scene without a potential answers.
    pure subroutine no_potential(v, stat)
        real(wp), intent(out) :: v
        integer, intent(out) :: stat

        v = ieee_value(v, ieee_quiet_nan)
        stat = status_ok
    end subroutine no_potential

    !> The hook of runs on many processes. `integrate` calls it wherever it may have to end the run: once at
    !> the start, after each torque, after a drift that closes a step, after each drift of the user's and
    !> after each observer, with the code of this process, mostly `status_ok`; the returned code decides.
    !> `extrapolate` does the same, and asks too whether a step is finite everywhere. A scene that shares its
    !> torques among processes overrides it with the largest code of all (MPI_Allreduce with MPI_MAX): then
    !> all processes end together, whichever of them refuses. Its own codes should then be positive; scheme,
    !> step, numbers of steps, observer and drift must be the same on all processes. The default does nothing.
    subroutine body_alone(self, code)
        class(body_scene), intent(inout) :: self
        integer, intent(inout) :: code

        associate (unused_self => self, unused_code => code)
        end associate
    end subroutine body_alone

    !> The same hook for a group.
    subroutine group_alone(self, code)
        class(group_scene), intent(inout) :: self
        integer, intent(inout) :: code

        associate (unused_self => self, unused_code => code)
        end associate
    end subroutine group_alone

end module frb_torque
