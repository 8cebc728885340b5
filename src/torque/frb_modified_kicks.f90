!> Kicks of a splitting scheme with the change of the torque: m += b h tau + c h^3 g.
!>
!> L_A V = -tau . I^-1 m, so [B,[A,B]] is the function G = tau . n of the attitude, n = I^-1 tau: the kick is
!> that of the potential V - (c/b) h^2 G. Its torque, and what the commutator gives for a torque without a
!> potential too, is
!>
!>     g = 2 (D_n tau + n x tau),   D_n tau = d/de tau(q exp(e n)) at e = 0,
!>
!> all in the body frame. The term n x tau is the curvature of the rotation group: the formula known from
!> flat space lacks it, and without it every such scheme falls back to order 2.
!>
!> If the scene does not provide D_n tau, it comes from displaced torques, with q turned by e n and by -e n,
!> e = h^2/4: (tau(+) - tau(-))/(2 e) has an error of order h^4, so order 6 is kept. One torque at q turned by
!> d = 2 (c/b) h^2 n, tau(q exp(d)) + d x tau in the place of tau + (c/b) h^2 g, keeps order 4.
!>
!> Sources: M. Suzuki, Phys. Lett. A 201 (1995) 425, S. A. Chin, Phys. Lett. A 226 (1997) 344 for flat space.
module frb_modified_kicks
    use frb_inertia, only: body_core, from_principal, to_principal
    use frb_kinds, only: wp
    use frb_rotations, only: cross, quat_product
    implicit none
    private

    public :: angular_response, inverse_inertia, turned, gradient_torque

contains

    !> I^-1 v in body axes; 0 about the axis of a linear rotor.
    pure function angular_response(core, v) result(w)
        type(body_core), intent(in) :: core
        real(wp), intent(in) :: v(3)
        real(wp) :: w(3)

        if (core%linear) then
            w = core%a(1)*(v - core%axis*dot_product(core%axis, v))
        else if (core%needs_rotation) then
            w = to_principal(core, v)
            w(core%order) = core%a*w(core%order)
            w = from_principal(core, w)
        else
            w(core%order) = core%a*v(core%order)
        end if
    end function angular_response

    !> I^-1 in the body frame, as angular_response.
    pure function inverse_inertia(core) result(response)
        type(body_core), intent(in) :: core
        real(wp) :: response(3, 3)

        response(:, 1) = angular_response(core, [1.0_wp, 0.0_wp, 0.0_wp])
        response(:, 2) = angular_response(core, [0.0_wp, 1.0_wp, 0.0_wp])
        response(:, 3) = angular_response(core, [0.0_wp, 0.0_wp, 1.0_wp])
    end function inverse_inertia

    !> The attitude turned about the vector v in the body by the angle 2 atan(|v|/2) instead of |v|: also an
    !> odd function of v, without a sine. If v overflows, q does not turn.
    pure function turned(q, v) result(p)
        real(wp), intent(in) :: q(4), v(3)
        real(wp) :: p(4)

        p = q
        if (all(abs(v) < 1.0e100_wp)) p = quat_product(q, [1.0_wp, 0.5_wp*v])/sqrt(1 + 0.25_wp*sum(v*v))
    end function turned

    !> g = 2 (D_n tau + n x tau) from the change D_n tau.
    pure function gradient_torque(n, tau, change) result(g)
        real(wp), intent(in) :: n(3), tau(3), change(3)
        real(wp) :: g(3)

        g = 2*(change + cross(n, tau))
    end function gradient_torque

end module frb_modified_kicks
