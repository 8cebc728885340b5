!> The angle psi of (8), (9), (14) and (16): exact by one integral of the third kind, or by quadrature.
!>
!> psi needs Pi(phi1) - Pi(phi0). By the addition theorem (DLMF 19.11.2) that is twice the integral from 0 to
!> lambda h/2 and arctangents of the phase. Their coefficient in psi is one, so together they are a rotation
!> z, rational in m(h/2) and sn, cn, dn of lambda h/2, and the attitude at h is
!>
!>     q(h) = (cos(angle/2), m(0) sin(angle/2)) z,      z takes m(h) to m(0).
!>
!> In the frames p of section 1.4, p(0) z p(h)^-1 is a rotation about e3: its angle is what psi has besides
!> `angle`, of which only cosine and sine are wanted. No arctangent, no branch is left, and errors of a frame
!> that turns fast are in z p(h)^-1 and p(h) alike and cancel.
!>
!> Three choices of n come out of the three axes:
!>
!>     axis 2: n of (9), B_23**-2 or B_21**-2        z has no component along e2
!>     axis 1: n of (16), -(B_31/B_13)**2, in case (ii) 1 - (B_23/B_13)**2        none along e1
!>     axis 3: the same with axes 1 and 3 exchanged, k**2 over that n             none along e3
!>
!> Of the last two the one with the smaller abs(n) <= 1 is taken: the other one adds up large angles that
!> nearly cancel when the body is a rod or m is near axis 3.
module frb_paper_angle
    use frb_agm, only: ellip_k
    use frb_carlson, only: rj
    use frb_kinds, only: wp
    use frb_paper_momentum, only: momentum_step
    use frb_paper_motion, only: paper_motion
    use frb_quadrature, only: eint_gauss
    implicit none
    private

    public :: exact_angle, quadrature_angle, angle_by_middle_axis, angle_by_outer_axes

    integer, parameter :: angle_by_middle_axis = 2  !! (9): frame from m and m'
    integer, parameter :: angle_by_outer_axes = 1   !! (16): frame from m and e3

contains

    !> The angle about m(0) that is linear in h but for one integral of the third kind, and the rotation z.
    pure subroutine exact_angle(motion, step, way, angle, z)
        type(paper_motion), intent(in) :: motion    !! an elliptic motion
        type(momentum_step), intent(in) :: step     !! from `momentum_by_addition`
        integer, intent(in) :: way                  !! `angle_by_middle_axis` or `angle_by_outer_axes`
        real(wp), intent(out) :: angle              !! [rad]
        real(wp), intent(out) :: z(4)               !! a quaternion of any nonzero norm
        real(wp) :: n_delta, n1, n3, largest

        associate (alpha => motion%alpha, beta => motion%beta, gamma => motion%gamma, p => motion%p, &
                   r => motion%r, s => step%s, c => step%c, d => step%d, m => step%middle)
            if (way == angle_by_middle_axis) then
                ! n delta: n = alpha/p in case (i), gamma/r in case (ii), and 1 - n = abs(delta)/p or /r
                n_delta = merge(-alpha, gamma, motion%first_case)*motion%nc
                angle = motion%a2*motion%time
                if (motion%nc > 0.0_wp) then
                    angle = angle + third_kind(2*n_delta/motion%lambda, motion, step, &
                                               step%cn**2 + motion%nc*step%sn**2, motion%nc)
                end if
                z(1) = c*d
                z(2) = gamma*m(1)*s*d
                z(3) = 0.0_wp
                z(4) = -alpha*m(3)*s*c
            else
                if (motion%first_case) then
                    n1 = r/p
                    n3 = alpha/gamma
                else
                    n1 = gamma/alpha
                    n3 = p/r
                end if
                if (n1 <= n3) then
                    angle = motion%time - third_kind(2*n1*(beta/motion%lambda), motion, step, &
                                                     1 + n1*step%sn**2, 1 + n1)
                    z(1) = d
                    z(2) = 0.0_wp
                    z(3) = -gamma*m(2)*s*d
                    z(4) = -beta*m(3)*s
                else
                    angle = motion%a3*motion%time + third_kind(2*n3*(beta/motion%lambda), motion, step, &
                                                               1 + n3*step%sn**2, 1 + n3)
                    z(1) = c
                    z(2) = beta*m(1)*s
                    z(3) = alpha*m(2)*s*c
                    z(4) = 0.0_wp
                end if
            end if
        end associate
        largest = max(abs(z(1)), abs(z(2)), abs(z(3)), abs(z(4)))
        if (largest < 1.0e-100_wp) z = z/largest    ! long after the middle axis was reached
    end subroutine exact_angle

    !> factor int_0^u sn**2/(1 - n sn**2) du = factor (Pi(u) - u)/n up to u = lambda h/2, by Carlson's RJ: one
    !> inside the first quarter period, a second one, the complete integral, beyond. The complete one can be
    !> as large as its factor is small, and both meet counts up to 1e300: so the factor comes first.
    pure function third_kind(factor, motion, step, last, last_complete) result(integral)
        real(wp), intent(in) :: factor
        type(paper_motion), intent(in) :: motion
        type(momentum_step), intent(in) :: step
        real(wp), intent(in) :: last            !! 1 - n sn**2 at u
        real(wp), intent(in) :: last_complete   !! 1 - n
        real(wp) :: integral
        real(wp) :: sn, complete

        sn = step%sn
        if (abs(step%half_turns) > 0.0_wp) sn = sn*(1 - 2*abs(mod(step%half_turns, 2.0_wp)))
        integral = factor*(sn**3*(1.0_wp/3)*rj(step%cn**2, step%dn**2, 1.0_wp, last))
        if (abs(step%half_turns) > 0.0_wp) then
            complete = rj(0.0_wp, motion%kc2, 1.0_wp, last_complete)
            integral = integral + step%half_turns*(factor*((2.0_wp/3)*complete))
        end if
        ! on the separatrix sn = +-1 from there on
        if (abs(step%excess) > 0.0_wp) integral = integral + factor*step%excess/last_complete
    end function third_kind

    !> psi of (9), or of (16) without f, with the integral of the third kind by np Gauss points, (20).
    function quadrature_angle(motion, step, way, np, stat) result(psi)
        type(paper_motion), intent(in) :: motion    !! an elliptic motion off the separatrix
        type(momentum_step), intent(in) :: step     !! from `momentum_by_phase`
        integer, intent(in) :: way                  !! `angle_by_middle_axis` or `angle_by_outer_axes`
        integer, intent(in) :: np                   !! number of points, >= 1
        integer, intent(out) :: stat
        real(wp) :: psi
        real(wp) :: rate, constant_rate, nc, along

        associate (m => motion%m)
            if (way == angle_by_middle_axis) then
                constant_rate = m(1)**2 + motion%a2*m(2)**2 + motion%a3*m(3)**2
                rate = merge(-motion%p, motion%r, motion%first_case)*motion%nc     ! delta
                nc = motion%nc
            else
                constant_rate = motion%a3
                rate = motion%beta
                nc = motion%beta/merge(motion%p, motion%alpha, motion%first_case)
            end if
            along = sign(motion%lambda, merge(m(1), m(3), motion%first_case))
            psi = eint_gauss(step%phi0, step%phi1, 1 - nc, 0.0_wp, np, motion%kc2, nc, stat)
            psi = constant_rate*motion%time + (rate/along)*psi
        end associate
    end function quadrature_angle

end module frb_paper_angle
