!> flow_tangent against automatic derivatives of the closed form of the step, in dual numbers.
module frb_test_tangent_duals
    use frb_checks, only: tally, worst_of
    use frb_dual_flow, only: dual_step, points
    use frb_elliptic, only: gauss_legendre
    use frb_flow_samples, only: stream, no_turn
    use frb_free_flow, only: flow_tangent, rigid_body
    use frb_kinds, only: wp
    implicit none
    private

    public :: test_tangent_duals

contains

    subroutine test_tangent_duals(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: rounding = 16*epsilon(1.0_wp)
        type(stream) :: random
        real(wp) :: moments(3), m0(3), m(3), q(4), h, transition(6, 6), by_moments(6, 3), by_m(6, 3), &
            by_i(6, 3)
        real(wp) :: worst(4), nodes(points), weights(points)
        integer :: i

        call t%open_suite('tangent-duals', 4)
        call gauss_legendre(points, nodes, weights)
        worst = 0.0_wp
        do i = 1, 500
            moments = random%triangle()
            m0 = random%direction()
            h = moments(1)*random%log_uniform(-3.0_wp, -0.7_wp)
            call dual_step(moments, m0, h, nodes, weights, by_m, by_i)
            m = m0
            q = no_turn
            call flow_tangent(rigid_body(moments), h, m, q, transition, by_moments)
            worst(1) = worst_of(worst(1), relative(transition(1:3, 1:3), by_m(1:3, :)))
            worst(2) = worst_of(worst(2), relative(transition(4:6, 1:3), by_m(4:6, :)))
            worst(3) = worst_of(worst(3), relative(by_moments(1:3, :), by_i(1:3, :)))
            worst(4) = worst_of(worst(4), relative(by_moments(4:6, :), by_i(4:6, :)))
        end do
        call t%at_most('J-is-that-of-dual-numbers', worst(1), rounding)
        call t%at_most('W-is-that-of-dual-numbers', worst(2), rounding)
        call t%at_most('m-by-the-moments-is-that-of-dual-numbers', worst(3), rounding)
        call t%at_most('theta-by-the-moments-is-that-of-dual-numbers', worst(4), rounding)
        call t%close_suite()
    end subroutine test_tangent_duals

    !> |x - y|/|y|, Frobenius norms.
    pure function relative(x, y) result(error)
        real(wp), intent(in) :: x(:, :), y(:, :)
        real(wp) :: error

        error = norm2(x - y)/norm2(y)
    end function relative

end module frb_test_tangent_duals
