!> What a user fills in to put torque on a body: the scene (the torque), the observer (who watches a run) and
!> the drift (who moves the free body, when it is not to be the free flow). All three are extensible types, so
!> that parameters travel in components and nothing is global.
!>
!> Torque and momentum are in the body frame: m' = m x I^-1 m + tau(q, t), q' = q (0, I^-1 m)/2. A torque from
!> a potential V(q) is tau = sum over body vectors u = Q^T u0 that V depends on of u x dV/du.
module frb_torque
    use frb_free_flow, only: rigid_body
    use frb_kinds, only: wp
    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
    implicit none
    private

    public :: body_scene, group_scene, body_observer, group_observer, body_drift

    !> The torque on one body. Extend it with the scene's parameters, give `torque`, and give `potential` too
    !> where there is one and the energy is to be watched.
    type, abstract :: body_scene
    contains
        procedure(torque_on_body), deferred :: torque
        procedure :: potential => body_potential_unknown
    end type body_scene

    !> The torques on n bodies that interact: each sees the attitudes of all. Centres are the scene's own
    !> matter: components where they stand still, functions of t where they move.
    type, abstract :: group_scene
    contains
        procedure(torques_on_group), deferred :: torques
        procedure :: potential => group_potential_unknown
    end type group_scene

    !> Watches a run of one body.
    type, abstract :: body_observer
    contains
        procedure(observe_body), deferred :: observe
    end type body_observer

    !> Watches a run of n bodies.
    type, abstract :: group_observer
    contains
        procedure(observe_group), deferred :: observe
    end type group_observer

    !> A flow of the free body, or an approximation of it, to take the place of `free_flow`.
    type, abstract :: body_drift
    contains
        procedure(advance_body), deferred :: advance
    end type body_drift

    abstract interface
        !> The torque at attitude q and time t.
        pure subroutine torque_on_body(self, q, t, tau)
            import :: body_scene, wp
            implicit none
            class(body_scene), intent(in) :: self
            real(wp), intent(in) :: q(4)        !! attitude, unit quaternion, body to space
            real(wp), intent(in) :: t           !! time
            real(wp), intent(out) :: tau(3)     !! torque, body frame
        end subroutine torque_on_body

        !> The torques at the attitudes q and time t.
        pure subroutine torques_on_group(self, q, t, tau)
            import :: group_scene, wp
            implicit none
            class(group_scene), intent(in) :: self
            real(wp), contiguous, intent(in) :: q(:, :)     !! attitudes (4, n), unit quaternions
            real(wp), intent(in) :: t                       !! time
            real(wp), contiguous, intent(out) :: tau(:, :)  !! torques (3, n), each in its body's frame
        end subroutine torques_on_group

        !> Called with the state after `step` steps, at time t; the run goes on unaffected.
        subroutine observe_body(self, step, t, m, q)
            import :: body_observer, wp
            implicit none
            class(body_observer), intent(inout) :: self
            integer, intent(in) :: step         !! steps done, 0 at the start
            real(wp), intent(in) :: t           !! time
            real(wp), intent(in) :: m(3)        !! angular momentum, body frame
            real(wp), intent(in) :: q(4)        !! attitude
        end subroutine observe_body

        !> Called with the state after `step` steps, at time t; the run goes on unaffected.
        subroutine observe_group(self, step, t, m, q)
            import :: group_observer, wp
            implicit none
            class(group_observer), intent(inout) :: self
            integer, intent(in) :: step                     !! steps done, 0 at the start
            real(wp), intent(in) :: t                       !! time
            real(wp), contiguous, intent(in) :: m(:, :)     !! angular momenta (3, n), body frames
            real(wp), contiguous, intent(in) :: q(:, :)     !! attitudes (4, n)
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

    !> NaN: this scene gives no potential.
    pure function body_potential_unknown(self, q, t) result(v)
        class(body_scene), intent(in) :: self
        real(wp), intent(in) :: q(4), t
        real(wp) :: v

        associate (unused_self => self, unused_q => q, unused_t => t)
        end associate
        v = ieee_value(v, ieee_quiet_nan)
    end function body_potential_unknown

    !> NaN: this scene gives no potential.
    pure function group_potential_unknown(self, q, t) result(v)
        class(group_scene), intent(in) :: self
        real(wp), contiguous, intent(in) :: q(:, :)
        real(wp), intent(in) :: t
        real(wp) :: v

        associate (unused_self => self, unused_q => q, unused_t => t)
        end associate
        v = ieee_value(v, ieee_quiet_nan)
    end function group_potential_unknown

end module frb_torque
