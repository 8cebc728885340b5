!> Scenes that come with the library: a heavy top, and a wrapper around a user's plain procedures.
module frb_scenes
    use frb_kinds, only: wp
    use frb_rotations, only: quat_rotate
    use frb_status, only: status_ok, status_bad_torque, status_not_offered
    use frb_torque, only: body_scene, lanes => scene_lanes, torque_lane_by_lane, one_after_the_other
    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
    implicit none
    private

    public :: heavy_top, plain_scene, plain_torque, plain_potential

    !> A body with a fixed point under a constant force at one of its points: V = force . Q centre.
    !> The paper's heavy top (section 4.3) has force = u0 and centre = e3.
    !>
    !> In a type that extends this one, `torque_lanes`, `torque_change` and `torque_and_gradient` are those of
    !> body_scene, which use the `torque` of that type, unless the type overrides them too.
    type, extends(body_scene) :: heavy_top
        real(wp) :: force(3) = [0.0_wp, 0.0_wp, 1.0_wp]     !! gradient of V, in space
        real(wp) :: centre(3) = [0.0_wp, 0.0_wp, 1.0_wp]    !! point it acts at, in the body
    contains
        procedure :: torque => heavy_top_torque    !! u x centre
        procedure :: torque_change => heavy_top_torque_change    !! its derivative along a turn
        procedure :: torque_and_gradient => heavy_top_torque_and_gradient    !! both for modified kicks
        procedure :: torque_lanes => heavy_top_torque_lanes    !! the torque in lanes
        procedure :: potential => heavy_top_potential    !! force . Q centre
    end type heavy_top

    !> A scene made of plain procedures, for a torque without parameters: plain_scene(torque, potential).
    type, extends(body_scene) :: plain_scene
        procedure(plain_torque), pointer, nopass :: torque_of => null()
        procedure(plain_potential), pointer, nopass :: potential_of => null()   !! may stay null
    contains
        procedure :: torque => plain_scene_torque    !! the user's
        procedure :: potential => plain_scene_potential    !! the user's, or NaN
    end type plain_scene

    !> The interfaces of the procedures of a `plain_scene`.
    abstract interface
        !> The torque at attitude q and time t, in the body frame.
        subroutine plain_torque(q, t, tau)
            import :: wp
            implicit none
            real(wp), intent(in) :: q(4)
            real(wp), intent(in) :: t
            real(wp), intent(out) :: tau(3)
        end subroutine plain_torque

        !> The potential energy at attitude q and time t.
        function plain_potential(q, t) result(v)
            import :: wp
            implicit none
            real(wp), intent(in) :: q(4)
            real(wp), intent(in) :: t
            real(wp) :: v
        end function plain_potential
    end interface

contains

    !> u x centre with u = Q^T force; for the paper's top (u2, -u1, 0).
    pure subroutine heavy_top_torque(self, q, t, tau, stat)
        class(heavy_top), intent(inout) :: self
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: tau(3)
        integer, intent(out) :: stat
        real(wp) :: u1, u2, u3

        associate (unused_t => t)
        end associate
        call force_in_body(self%force, q(1), q(2), q(3), q(4), u1, u2, u3)
        call cross_product(u1, u2, u3, self%centre(1), self%centre(2), self%centre(3), tau(1), tau(2), tau(3))
        stat = status_ok
    end subroutine heavy_top_torque

    !> The torque in lanes.
    subroutine heavy_top_torque_lanes(self, q, t, tau, stat)
        class(heavy_top), intent(inout) :: self
        real(wp), intent(in) :: q(lanes, 4), t(lanes)
        real(wp), intent(out) :: tau(lanes, 3)
        integer, intent(out) :: stat
        real(wp) :: force(3), centre(3), u1, u2, u3
        integer :: l

        select type (self)
        type is (heavy_top)
            force = self%force
            centre = self%centre
            do l = 1, lanes
                call force_in_body(force, q(l, 1), q(l, 2), q(l, 3), q(l, 4), u1, u2, u3)
                call cross_product(u1, u2, u3, centre(1), centre(2), centre(3), &
                                   tau(l, 1), tau(l, 2), tau(l, 3))
            end do
            stat = status_ok
        class default
            call torque_lane_by_lane(self, q, t, tau, stat)
        end select
    end subroutine heavy_top_torque_lanes

    !> (u x n) x centre, because u changes by u x n.
    pure subroutine heavy_top_torque_change(self, q, t, n, change, stat)
        class(heavy_top), intent(inout) :: self
        real(wp), intent(in) :: q(4), t, n(3)
        real(wp), intent(out) :: change(3)
        integer, intent(out) :: stat
        real(wp) :: u1, u2, u3, w1, w2, w3

        associate (unused_t => t)
        end associate
        stat = status_ok
        select type (self)
        type is (heavy_top)
            call force_in_body(self%force, q(1), q(2), q(3), q(4), u1, u2, u3)
            call cross_product(u1, u2, u3, n(1), n(2), n(3), w1, w2, w3)
            call cross_product(w1, w2, w3, self%centre(1), self%centre(2), self%centre(3), &
                               change(1), change(2), change(3))
        class default
            change = 0.0_wp
            stat = status_not_offered
        end select
    end subroutine heavy_top_torque_change

    !> tau = u x c and g = 2 (D_n tau + n x tau) = 2 u x (n x c), c the centre. n x c = (I^-1 (u x c)) x c is
    !> linear in u: its matrix does not wait for u. A centre on the third axis leaves few products, and a
    !> modified kick then costs 2 ns more than a plain one instead of 5.
    subroutine heavy_top_torque_and_gradient(self, q, t, response, tau, g, stat)
        class(heavy_top), intent(inout) :: self
        real(wp), intent(in) :: q(4), t, response(3, 3)
        real(wp), intent(out) :: tau(3), g(3)
        integer, intent(out) :: stat
        real(wp) :: u1, u2, u3, c1, c2, c3, w1, w2, w3, r11, r21, r22, r(3, 3)
        integer :: i

        select type (self)
        type is (heavy_top)
            c1 = self%centre(1)
            c2 = self%centre(2)
            c3 = self%centre(3)
            call force_in_body(self%force, q(1), q(2), q(3), q(4), u1, u2, u3)
            call cross_product(u1, u2, u3, c1, c2, c3, tau(1), tau(2), tau(3))
            stat = status_ok
            if (abs(c1) + abs(c2) > 0.0_wp) then
                do i = 1, 3
                    ! n_i = R_i . (u x c) = (c x R_i) . u, R_i a row of the response.
                    call cross_product(c1, c2, c3, response(i, 1), response(i, 2), response(i, 3), &
                                       r(i, 1), r(i, 2), r(i, 3))
                end do
                w1 = (r(2, 1)*c3 - r(3, 1)*c2)*u1 + (r(2, 2)*c3 - r(3, 2)*c2)*u2 &
                     + (r(2, 3)*c3 - r(3, 3)*c2)*u3
                w2 = (r(3, 1)*c1 - r(1, 1)*c3)*u1 + (r(3, 2)*c1 - r(1, 2)*c3)*u2 &
                     + (r(3, 3)*c1 - r(1, 3)*c3)*u3
                w3 = (r(1, 1)*c2 - r(2, 1)*c1)*u1 + (r(1, 2)*c2 - r(2, 2)*c1)*u2 &
                     + (r(1, 3)*c2 - r(2, 3)*c1)*u3
                call cross_product(2*u1, 2*u2, 2*u3, w1, w2, w3, g(1), g(2), g(3))
            else
                r11 = (2*c3*c3)*response(1, 1)
                r21 = (2*c3*c3)*response(2, 1)
                r22 = (2*c3*c3)*response(2, 2)
                g(1) = u3*(r11*u2 - r21*u1)
                g(2) = u3*(r21*u2 - r22*u1)
                g(3) = (r22 - r11)*(u1*u2) + r21*((u1 - u2)*(u1 + u2))
            end if
        class default
            call one_after_the_other(self, q, t, response, tau, g, stat)
        end select
    end subroutine heavy_top_torque_and_gradient

    !> c = a x b, number by number: inlined, because a call would double the time of the torque.
    pure subroutine cross_product(a1, a2, a3, b1, b2, b3, c1, c2, c3)
        real(wp), intent(in) :: a1, a2, a3, b1, b2, b3
        real(wp), intent(out) :: c1, c2, c3

        c1 = a2*b3 - a3*b2
        c2 = a3*b1 - a1*b3
        c3 = a1*b2 - a2*b1
    end subroutine cross_product

    !> u = Q^T f. Written out in short chains of operations: a call of quat_rotate would cost more than that.
    !> w = 2 f x q, u = f + q0 w + w x q.
    pure subroutine force_in_body(force, q0, q1, q2, q3, u1, u2, u3)
        real(wp), intent(in) :: force(3), q0, q1, q2, q3
        real(wp), intent(out) :: u1, u2, u3
        real(wp) :: f(3), w1, w2, w3

        f = 2*force
        w1 = f(2)*q3 - f(3)*q2
        w2 = f(3)*q1 - f(1)*q3
        w3 = f(1)*q2 - f(2)*q1
        u1 = (force(1) + q0*w1) + (w2*q3 - w3*q2)
        u2 = (force(2) + q0*w2) + (w3*q1 - w1*q3)
        u3 = (force(3) + q0*w3) + (w1*q2 - w2*q1)
    end subroutine force_in_body

    !> V = force . Q centre.
    pure subroutine heavy_top_potential(self, q, t, v, stat)
        class(heavy_top), intent(inout) :: self
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: v
        integer, intent(out) :: stat

        associate (unused_t => t)
        end associate
        v = dot_product(self%force, quat_rotate(q, self%centre))
        stat = status_ok
    end subroutine heavy_top_potential

    !> The user's torque; `status_bad_torque` when there is none.
    subroutine plain_scene_torque(self, q, t, tau, stat)
        class(plain_scene), intent(inout) :: self
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: tau(3)
        integer, intent(out) :: stat

        if (associated(self%torque_of)) then
            call self%torque_of(q, t, tau)
            stat = status_ok
        else
            tau = 0.0_wp
            stat = status_bad_torque
        end if
    end subroutine plain_scene_torque

    !> The user's potential; NaN when there is none.
    subroutine plain_scene_potential(self, q, t, v, stat)
        class(plain_scene), intent(inout) :: self
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: v
        integer, intent(out) :: stat

        if (associated(self%potential_of)) then
            v = self%potential_of(q, t)
        else
            v = ieee_value(v, ieee_quiet_nan)
        end if
        stat = status_ok
    end subroutine plain_scene_potential

end module frb_scenes
