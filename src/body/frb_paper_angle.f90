!> The angle psi of (8), (9), (14) and (16): exact by one integral of the third kind, or by quadrature.
!>
!> psi contains Pi(phi1) - Pi(phi0). By the addition theorem (DLMF 19.11.2) this is twice the integral from 0
!> to lambda h/2 plus arctangents of the phase. The arctangents have the coefficient one in psi, so together
!> they are a rotation z, rational in m(h/2) and in sn, cn, dn of lambda h/2, and the attitude at h is
!>
!>     q(h) = (cos(angle/2), m(0) sin(angle/2)) z,      z takes m(h) to m(0).
!>
!> In the frames p of section 1.4, p(0) z p(h)^-1 is a rotation about e3, and psi is its angle plus `angle`.
!> Only the cosine and the sine of psi are needed: no arctangent is formed and no branch is chosen. Errors of
!> a frame that turns fast are in z p(h)^-1 and in p(h), and cancel.
!>
!> Each of the three axes gives a choice of n, and a z without a component along that axis:
!>
!>     axis 2: n of (9), B_23**-2 or B_21**-2
!>     axis 1: n of (16), -(B_31/B_13)**2, in case (ii) 1 - (B_23/B_13)**2
!>     axis 3: the same with axes 1 and 3 exchanged, k**2 over the n of axis 1
!>
!> Of axes 1 and 3 the one with the smaller abs(n) <= 1 is taken. With the other one, large angles nearly
!> cancel when the body is a rod or m is near axis 3.
module frb_paper_angle
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

    !> The angle about m(0) and the rotation z. With u = lambda h/2, S(n) = int_0^u sn**2/(1 - n sn**2) du,
    !> s, c, d of `momentum_step`, and m at h/2:
    !>
    !>     axis 2:  angle = a2 h + 2 n delta/lambda S(n),     z = (c d, gamma m1 s d, 0, -alpha m3 s c)
    !>     axis 1:  angle = h - 2 n1 beta/lambda S(-n1),      z = (d, 0, -gamma m2 s d, -beta m3 s)
    !>     axis 3:  angle = a3 h + 2 n3 beta/lambda S(-n3),   z = (c, beta m1 s, alpha m2 s c, 0)
    !>
    !>     case (i):   n = alpha/p,  n1 = r/p,          n3 = alpha/gamma
    !>     case (ii):  n = gamma/r,  n1 = gamma/alpha,  n3 = p/r
    pure subroutine exact_angle(motion, step, frame_axes, angle, z)
        type(paper_motion), intent(in) :: motion    !! an elliptic motion
        type(momentum_step), intent(in) :: step     !! from `momentum_by_addition`
        integer, intent(in) :: frame_axes           !! `angle_by_middle_axis` or `angle_by_outer_axes`
        real(wp), intent(out) :: angle              !! [rad]
        real(wp), intent(out) :: z(4)               !! a quaternion of any nonzero norm
        real(wp) :: n1, n3, largest

        associate (alpha => motion%alpha, beta => motion%beta, gamma => motion%gamma, &
                   s => step%s, c => step%c, d => step%d, m => step%middle)
            if (motion%first_case) then
                n1 = motion%r/motion%p
                n3 = alpha/gamma
            else
                n1 = gamma/alpha
                n3 = motion%p/motion%r
            end if
            if (frame_axes == angle_by_middle_axis) then
                angle = motion%a2*motion%time
                ! n delta, from delta = -p (1 - n) or r (1 - n), is -alpha (1 - n) or gamma (1 - n).
                if (motion%nc > 0.0_wp) angle = angle + third_kind( &
                    2*(merge(-alpha, gamma, motion%first_case)*motion%nc)/motion%lambda, motion, step, &
                    step%cn**2 + motion%nc*step%sn**2, motion%nc)
                z = [c*d, gamma*m(1)*s*d, 0.0_wp, -alpha*m(3)*s*c]
            else if (n1 <= n3) then
                angle = motion%time - third_kind(2*n1*(beta/motion%lambda), motion, step, &
                                                 1 + n1*step%sn**2, 1 + n1)
                z = [d, 0.0_wp, -gamma*m(2)*s*d, -beta*m(3)*s]
            else
                angle = motion%a3*motion%time + third_kind(2*n3*(beta/motion%lambda), motion, step, &
                                                           1 + n3*step%sn**2, 1 + n3)
                z = [c, beta*m(1)*s, alpha*m(2)*s*c, 0.0_wp]
            end if
        end associate
        largest = max(abs(z(1)), abs(z(2)), abs(z(3)), abs(z(4)))
        if (largest < 1.0e-100_wp) z = z/largest    ! after a long stay near the middle axis
    end subroutine exact_angle

    !> factor S(n) = factor (Pi(u) - u)/n by Carlson's RJ: one RJ for u in the first quarter period, and the
    !> complete integral too beyond it. The factor multiplies first: the complete integral may be huge where
    !> the factor is tiny, and the number of half turns is up to 1e300.
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
        ! On the separatrix sn = +-1 over the excess.
        if (abs(step%excess) > 0.0_wp) integral = integral + factor*step%excess/last_complete
    end function third_kind

    !> psi of (9), or of (16) without f, with the integral of the third kind by np Gauss points, (20).
    function quadrature_angle(motion, step, frame_axes, np, stat) result(psi)
        type(paper_motion), intent(in) :: motion    !! an elliptic motion off the separatrix
        type(momentum_step), intent(in) :: step     !! from `momentum_by_phase`
        integer, intent(in) :: frame_axes           !! `angle_by_middle_axis` or `angle_by_outer_axes`
        integer, intent(in) :: np                   !! number of points, >= 1
        integer, intent(out) :: stat
        real(wp) :: psi
        real(wp) :: rate, constant_rate, nc, along

        associate (m => motion%m)
            if (frame_axes == angle_by_middle_axis) then
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
