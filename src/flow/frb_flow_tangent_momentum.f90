!> The derivative of the momentum of one body alone, for steps that the series reach: see
!> tangent_step_momentum.inc. It needs neither the turn nor one of the two mirror forms.
module frb_flow_tangent_momentum
    use frb_flow_limits, only: tiny_limit, short_limit, middle_limit
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    implicit none
    private

    public :: short_jacobian

contains

    !> Advances m by 2 t and forms `jacobian`. `done` is .false., and nothing is changed, when the step is too
    !> long for the series. All numbers plain.
    pure subroutine short_jacobian(body, t, m, jacobian, done)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: t
        real(wp), intent(inout) :: m(3), jacobian(3, 3)
        logical, intent(out) :: done
        real(wp) :: a, b, g, m1, m2, m3, p, r, y, scd, dd, aa, bb, k, e1, e2, e3, x1, x2, x3, s1, s2, s3
        real(wp) :: inverse, over_c, over_d, over_cc, over_dd
        real(wp) :: j11, j12, j13, j21, j22, j23, j31, j32, j33
        integer :: i1, i2, i3

        call sort_momentum(body, m, i1, i2, i3, m1, m2, m3)
        a = body%alpha*t
        b = body%beta*t
        g = body%gamma*t
        k = (a*g)*(m2*m2)
        p = (b*g)*(m1*m1) + k
        r = k + (a*b)*(m3*m3)
        done = max(p, r) <= middle_limit
        if (.not. done) return
        if (max(p, r) <= tiny_limit) then
            call tiny_series(p + r, p*r, y, scd)
            call tiny_integrals(p + r, p*r, p, r, dd, aa, bb)
        else if (max(p, r) <= short_limit) then
            call short_series(p + r, p*r, y, scd)
            call short_integrals(p + r, p*r, p, r, dd, aa, bb)
        else
            call middle_series(p + r, p*r, y, scd)
            call middle_integrals(p*y, r*y, dd, aa, bb)
            k = y*sqrt(y)
            aa = k*aa
            bb = k*bb
        end if
        call invert_all(a*g, m2, p, r, y, scd, inverse, over_c, over_d, over_cc, over_dd)
        call momentum_at_end(a, b, g, m1, m2, m3, p, r, y, scd, inverse, e1, e2, e3, x1, x2, x3, s1, s2, s3)
        e1 = m1 + e1
        e2 = m2 + e2
        e3 = m3 + e3
        m(i1) = e1
        m(i2) = e2
        m(i3) = body%parity*e3
        call jacobian_at_end(a, b, g, m1, m2, m3, e1, e2, e3, x1, x2, x3, s1, s2, s3, y, scd, aa, bb, &
                             inverse, over_c, over_d, over_cc, over_dd, &
                             j11, j12, j13, j21, j22, j23, j31, j32, j33)
        jacobian(i1, i1) = 1 + j11
        jacobian(i1, i2) = j12
        jacobian(i1, i3) = body%parity*j13
        jacobian(i2, i1) = j21
        jacobian(i2, i2) = 1 + j22
        jacobian(i2, i3) = body%parity*j23
        jacobian(i3, i1) = body%parity*j31
        jacobian(i3, i2) = body%parity*j32
        jacobian(i3, i3) = 1 + j33
    end subroutine short_jacobian

    include 'sorted_momentum.inc'

    include 'series_formulas.inc'

    include 'tiny_formulas.inc'

    include 'middle_formulas.inc'

    include 'short_coefficients.inc'

    include 'tangent_short_integrals.inc'

    include 'tangent_tiny_integrals.inc'

    include 'tangent_step_momentum.inc'

    include 'middle_polynomials.inc'

    include 'tangent_middle_formulas.inc'

end module frb_flow_tangent_momentum
