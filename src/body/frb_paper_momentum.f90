!> Update of the momentum, section 3.2, in two ways.
!>
!> `momentum_by_addition`, for exact steps, follows the last paragraph of that section. The addition formulae
!> of sn, cn, dn need only sn, cn, dn of the phase nu, and these are the components of m(0). So no elliptic
!> integral of the first kind is inverted, no quadrant is decided, and one Landen transformation at lambda h/2
!> is enough. Written in m itself the formulae hold in all three cases. The step is old value plus change: its
!> rounding errors are those of the change, small for small h.
!>
!> `momentum_by_phase`, for steps with quadrature, finds the phase: the quadrature (20) needs the amplitudes
!> at both ends. It takes one AGM sequence, one Landen transformation up and one down.
module frb_paper_momentum
    use frb_agm, only: jacobi, landen_step, ellip_k
    use frb_kinds, only: wp, half_pi
    use frb_paper_motion, only: paper_motion
    implicit none
    private

    public :: momentum_step, momentum_by_addition, momentum_by_phase

    !> From this half step on, in units of 1/lambda, m(h) is formed from m(0), not from m(h/2): m(h/2) may be
    !> so close to the middle axis that its rounding errors grow.
    real(wp), parameter :: long_half_step = 3.0_wp

    !> On the separatrix m is at rest, to 1e-260, beyond this half step, in units of 1/lambda.
    real(wp), parameter :: long_on_separatrix = 300.0_wp

    !> A step of the unit momentum in sorted axes, and the numbers that the attitude needs.
    type :: momentum_step
        real(wp) :: change(3)       !! m(h) - m(0)
        real(wp) :: m(3)            !! m(h)
        real(wp) :: middle(3)       !! m(h/2)
        real(wp) :: sn, cn, dn      !! of lambda h/2
        real(wp) :: s, c, d         !! sn/lambda; cn and dn in case (i), dn and cn in case (ii)
        real(wp) :: half_turns      !! lambda h/2 is 2 K times this whole number, and at most K more or less
        real(wp) :: excess          !! on the separatrix: part of lambda h/2 beyond `long_on_separatrix`
        real(wp) :: phi0, phi1      !! amplitudes at 0 and h
    end type momentum_step

contains

    !> m(h/2) and m(h) by the addition formulae; phi0 and phi1 are not set.
    !> Accuracy: median below 1 and maximum below 3 units of the inherent sensitivity in every group of the
    !> reference cases; checked by steps.
    pure subroutine momentum_by_addition(motion, step)
        type(paper_motion), intent(in) :: motion    !! an elliptic motion
        type(momentum_step), intent(out) :: step
        real(wp) :: u, s, c, d, denominator, factor, mid1, mid2, mid3

        associate (m1 => motion%m(1), m2 => motion%m(2), m3 => motion%m(3), alpha => motion%alpha, &
                   beta => motion%beta, gamma => motion%gamma)
            u = 0.5_wp*(motion%lambda*motion%time)
            step%excess = 0.0_wp
            step%half_turns = 0.0_wp
            if (motion%kc2 <= 0.0_wp .and. abs(u) > long_on_separatrix) then
                step%excess = u - sign(long_on_separatrix, u)
                u = sign(long_on_separatrix, u)
            end if
            call jacobi(u, 0.0_wp, step%sn, step%cn, step%dn, motion%kc2)
            if (abs(u) > half_pi .and. motion%kc2 > 0.0_wp) then
                step%half_turns = anint(0.5_wp*u/ellip_k(0.0_wp, motion%kc2))
            end if
            s = step%sn/motion%lambda
            ! D = 1 - alpha gamma m2**2 s**2 as a sum of squares, which keeps its digits near the separatrix.
            if (motion%first_case) then
                c = step%cn
                d = step%dn
                denominator = c*c + beta*gamma*(m1*s)**2
            else
                c = step%dn
                d = step%cn
                denominator = d*d + alpha*beta*(m3*s)**2
            end if
            factor = 1/denominator
            mid1 = (m1*d - (alpha*m2*m3*s)*c)*factor
            mid2 = (m2*c*d + beta*m3*m1*s)*factor
            mid3 = (m3*c - (gamma*m1*m2*s)*d)*factor
            if (abs(u) > long_half_step) then
                call add_long_step(motion, step)
            else
                if (motion%first_case) then
                    denominator = c*c + beta*gamma*(mid1*s)**2
                else
                    denominator = d*d + alpha*beta*(mid3*s)**2
                end if
                factor = 2*s/denominator
                step%change(1) = -alpha*mid2*(mid3*factor*c)
                step%change(2) = beta*mid3*(mid1*factor)
                step%change(3) = -gamma*mid2*(mid1*factor*d)
                step%m = motion%m + step%change
            end if
            step%middle(1) = mid1
            step%middle(2) = mid2
            step%middle(3) = mid3
            step%s = s
            step%c = c
            step%d = d
        end associate
    end subroutine momentum_by_addition

    !> m(h) from m(0) in one piece, with sn, cn, dn of lambda h from those of lambda h/2.
    pure subroutine add_long_step(motion, step)
        type(paper_motion), intent(in) :: motion
        type(momentum_step), intent(inout) :: step
        real(wp) :: denominator, sn, cn, dn, s, c, d

        associate (m => motion%m, alpha => motion%alpha, beta => motion%beta, gamma => motion%gamma)
            denominator = step%cn**2 + (step%sn*step%dn)**2
            sn = 2*step%sn*step%cn*step%dn/denominator
            cn = ((step%cn*step%dn)**2 - motion%kc2*step%sn**2)/denominator
            dn = ((step%cn*step%dn)**2 + motion%kc2*step%sn**2)/denominator
            s = sn/motion%lambda
            if (motion%first_case) then
                c = cn
                d = dn
                denominator = c*c + beta*gamma*(m(1)*s)**2
            else
                c = dn
                d = cn
                denominator = d*d + alpha*beta*(m(3)*s)**2
            end if
            step%m(1) = (m(1)*d - (alpha*m(2)*m(3)*s)*c)/denominator
            step%m(2) = (m(2)*c*d + beta*m(3)*m(1)*s)/denominator
            step%m(3) = (m(3)*c - (gamma*m(1)*m(2)*s)*d)/denominator
            step%change = step%m - m
        end associate
    end subroutine add_long_step

    !> m(h) and the amplitudes by the phase, (4) and (5); the components for h/2 are not set.
    pure subroutine momentum_by_phase(motion, step)
        type(paper_motion), intent(in) :: motion    !! an elliptic motion off the separatrix
        type(momentum_step), intent(out) :: step

        associate (m => motion%m, p => motion%p, r => motion%r, alpha => motion%alpha, beta => motion%beta, &
                   gamma => motion%gamma)
            ! `landen_step` takes sn and cn at the start up to a common factor.
            if (motion%first_case) then
                call landen_step(m(2)*sqrt(gamma), m(3)*sqrt(beta), sign(motion%lambda, m(1))*motion%time, &
                                 0.0_wp, step%sn, step%cn, step%dn, step%phi0, step%phi1, motion%kc2)
                step%m(1) = sign(sqrt(p/beta)*step%dn, m(1))
                step%m(2) = sqrt(r/gamma)*step%sn
                step%m(3) = sqrt(r/beta)*step%cn
            else
                call landen_step(m(2)*sqrt(alpha), m(1)*sqrt(beta), sign(motion%lambda, m(3))*motion%time, &
                                 0.0_wp, step%sn, step%cn, step%dn, step%phi0, step%phi1, motion%kc2)
                step%m(1) = sqrt(p/beta)*step%cn
                step%m(2) = sqrt(p/alpha)*step%sn
                step%m(3) = sign(sqrt(r/beta)*step%dn, m(3))
            end if
            step%change = step%m - m
        end associate
    end subroutine momentum_by_phase

end module frb_paper_momentum
