!> The methods the charts compare with: each reaches its order, the truth its digits. All are compiled in
!> quadruple precision from the files of the chart program, but the methods by a frame in double precision.
module frb_test_rivals
    use frb_checks, only: tally, largest, worst_of
    use frb_double_frames, only: frame_steps
    use frb_free_flow, only: free_flow, rigid_body
    use frb_kinds, only: wp, has_quad
    use frb_quad_dmv, only: rk, dmv_body, new_dmv_body, dmv_steps
    use frb_quad_rotations, only: rotation_steps
    use frb_quad_top, only: taylor_top
    use frb_quad_runge_kutta, only: rk4_steps, dormand_prince
    use frb_quad_truth, only: taylor_flow, taylor_period, long_truth
    implicit none
    private

    public :: test_rivals

    !> Error of the truth over a time of 10 or 100.
    real(wp), parameter :: tolerance_truth = 1.0e-28_wp
    !> Observed order may differ from the nominal one by this much.
    real(wp), parameter :: tolerance_order = 0.1_wp

    real(rk), parameter :: moments(3) = [0.6_rk, 0.8_rk, 1.0_rk]
    real(rk), parameter :: m0(3) = [1.8_rk, 0.4_rk, -0.9_rk]
    real(rk), parameter :: identity(4) = [1.0_rk, 0.0_rk, 0.0_rk, 0.0_rk]

contains

    subroutine test_rivals(t)
        type(tally), intent(inout) :: t

        call t%open_suite('rivals', 30)
        if (t%provided(has_quad, 6, 'truth, which needs 30 digits')) call check_truth(t)
        if (t%provided(has_quad, 5, 'truth of tops, which needs 30 digits')) call check_top(t)
        if (t%provided(has_quad, 14, 'orders, which need 30 digits')) call check_orders(t)
        call check_frames(t)
        call t%close_suite()
    end subroutine test_rivals

    !> The motion by a frame, with momenta round the axis of the least and of the largest moment, against the
    !> free flow: by theta functions to rounding, by Hermite quadrature to its order.
    subroutine check_frames(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: body(3) = [1.0_wp, 1.5_wp, 2.0_wp], time = 3.0_wp
        real(wp), parameter :: starts(3, 4) = reshape([0.5_wp, 0.6_wp, 0.7_wp, 0.9_wp, -0.3_wp, 0.2_wp, &
                                                       -0.9_wp, 0.1_wp, -0.3_wp, 0.1_wp, -0.5_wp, -0.9_wp], &
                                                      [3, 4])
        integer, parameter :: steps(2) = [16, 64]
        real(wp) :: m(3), q(4), m_end(3), q_end(4), worst, error(2)
        integer :: i, k

        worst = 0.0_wp
        do i = 1, size(starts, 2)
            m_end = starts(:, i)
            q_end = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            call free_flow(rigid_body(body), time, m_end, q_end)
            m = starts(:, i)
            q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            call frame_steps(body, .true., time, 1, m, q)
            worst = worst_of(worst, largest([norm2(m - m_end), min(norm2(q - q_end), norm2(q + q_end))]))
            do k = 1, 2
                m = starts(:, i)
                q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
                call frame_steps(body, .false., time/steps(k), steps(k), m, q)
                error(k) = min(norm2(q - q_end), norm2(q + q_end))
            end do
            call t%close_to('hermite-quadrature-has-order-4', log(error(1)/error(2))/log(4.0_wp), 4.0_wp, &
                            real(tolerance_order, wp))
        end do
        call t%at_most('theta-functions-are-exact', worst, 1.0e-14_wp)
    end subroutine check_frames

    !> End values of 30 digits at t = 10 (Hairer and Vilmart's two bodies) and t = 100 (tennis racket).
    subroutine check_truth(t)
        type(tally), intent(inout) :: t
        real(rk) :: m(3), q(4), m_long(3), q_long(4), period, turn(4)

        call end_values(t, 'truth-has-28-digits-on-the-asymmetric-body', moments, m0, 10.0_rk, &
            [1.765962508518207535727150482_rk, -0.6954641970330891194994927568_rk, &
             0.7795549814818710861007417738_rk], &
            [-0.7360613641607939361612411474_rk, -0.5707869512403507332546212462_rk, &
             -0.2993885718307900937437669433_rk, -0.2068390861046731924831171081_rk])
        call end_values(t, 'truth-has-28-digits-on-the-flat-body', [0.345_rk, 0.653_rk, 1.0_rk], m0, &
            10.0_rk, [1.805748694153316944124664435_rk, -0.2931590700520223516263628767_rk, &
             0.9291552148106494226863761060_rk], &
            [-0.5909531300598776824030520653_rk, 0.7497771466036242986823664977_rk, &
             -0.2775673505986917899234931261_rk, -0.1075406638671320485487867749_rk])
        call end_values(t, 'truth-has-28-digits-on-the-tennis-racket', [3.0_rk, 5.0_rk, 9.0_rk], &
            [0.0_rk, 2.0_rk, 0.01_rk], 100.0_rk, &
            [0.2090942628297760675113266181_rk, 1.972485481094647073085859142_rk, &
             0.2562822977158024670448625624_rk], &
            [0.9729650346542738322786753128_rk, -0.07171372908301691046137617088_rk, &
             -0.2164463177188846447851642727_rk, 0.03670386828593163761549255816_rk])

        call taylor_period(moments, m0, 100.0_rk, period, turn)
        m = m0
        q = identity
        call taylor_flow(moments, period, m, q)
        call t%at_most('momentum-returns-after-a-period', real(norm2(m - m0), wp), tolerance_truth)
        m = m0
        q = [0.5_rk, -0.5_rk, 0.5_rk, 0.5_rk]
        m_long = m
        q_long = q
        call taylor_flow(moments, -301.5_rk, m, q)
        call long_truth(moments, -301.5_rk, m_long, q_long)
        call t%at_most('skipping-periods-leaves-momentum-unchanged', real(norm2(m - m_long), wp), &
            tolerance_truth)
        call t%at_most('skipping-periods-leaves-attitude-unchanged', real(apart(q, q_long), wp), &
            tolerance_truth)
    end subroutine check_truth

    subroutine end_values(t, name, body, start, time, m_end, q_end)
        type(tally), intent(inout) :: t
        character(*), intent(in) :: name
        real(rk), intent(in) :: body(3), start(3), time, m_end(3), q_end(4)
        real(rk) :: m(3), q(4)

        m = start
        q = identity
        call taylor_flow(body, time, m, q)
        call t%at_most(name, largest(real([norm2(m - m_end), apart(q, q_end)], wp)), tolerance_truth*10)
    end subroutine end_values

    !> Conserved quantities of a heavy top: the energy with V = u3, and u . m with u = Q^T u0.
    subroutine check_top(t)
        type(tally), intent(inout) :: t
        real(rk), parameter :: u0(3) = [0.3_rk, -0.2_rk, 0.9_rk]
        real(rk) :: m(3), q(4), m_free(3), q_free(4), u(3)

        m = m0
        q = identity
        call taylor_top(moments, u0, 10.0_rk, m, q)
        u = into_body(q, u0)
        call t%at_most('top-conserves-energy', real(abs(sum((m**2 - m0**2)/moments)/2 + u(3) - u0(3)), wp), &
                       tolerance_truth)
        call t%at_most('top-conserves-momentum-along-the-force', &
                       real(abs(dot_product(u, m) - dot_product(u0, m0)), wp), tolerance_truth)
        call taylor_top(moments, u0, -10.0_rk, m, q)
        call t%at_most('top-run-back-returns-to-its-start', &
                       largest(real([norm2(m - m0), apart(q, identity)], wp)), 10*tolerance_truth)
        m = m0
        q = identity
        m_free = m0
        q_free = identity
        call taylor_top(moments, 0*u0, 10.0_rk, m, q)
        call taylor_flow(moments, 10.0_rk, m_free, q_free)
        call t%at_most('top-without-force-is-free', &
                       largest(real([norm2(m - m_free), apart(q, q_free)], wp)), &
                       tolerance_truth)
        ! An axisymmetric top under the force along its axis also keeps the momentum about that axis.
        m = m0
        call taylor_top([0.8_rk, 0.8_rk, 1.0_rk], u0, 10.0_rk, m, q)
        call t%at_most('symmetric-top-conserves-momentum-along-its-axis', real(abs(m(3) - m0(3)), wp), &
                       tolerance_truth)
    end subroutine check_top

    !> Q^T v, from the rotation matrix.
    pure function into_body(q, v) result(u)
        real(rk), intent(in) :: q(4), v(3)
        real(rk) :: u(3)

        u(1) = (1 - 2*(q(3)**2 + q(4)**2))*v(1) &
            + 2*(q(2)*q(3) + q(1)*q(4))*v(2) + 2*(q(2)*q(4) - q(1)*q(3))*v(3)
        u(2) = 2*(q(2)*q(3) - q(1)*q(4))*v(1) + (1 - 2*(q(2)**2 + q(4)**2))*v(2) &
            + 2*(q(3)*q(4) + q(1)*q(2))*v(3)
        u(3) = 2*(q(2)*q(4) + q(1)*q(3))*v(1) &
            + 2*(q(3)*q(4) - q(1)*q(2))*v(2) + (1 - 2*(q(2)**2 + q(3)**2))*v(3)
    end function into_body

    !> Errors at t = 1 with n and 2 n steps.
    subroutine check_orders(t)
        type(tally), intent(inout) :: t
        character(2) :: digits
        real(wp) :: order_m, order_q
        integer :: order

        do order = 2, 10, 2
            write (digits, '(i0)') order
            call observed('dmv', order, order_m, order_q)
            call t%close_to('dmv-has-order-'//trim(digits)//'-in-momentum', order_m, real(order, wp), &
                tolerance_order)
            call t%close_to('dmv-has-order-'//trim(digits)//'-in-attitude', order_q, real(order, wp), &
                tolerance_order)
        end do
        call observed('rot', 2, order_m, order_q)
        call t%close_to('three-rotations-have-order-2', min(order_m, order_q), 2.0_wp, tolerance_order)
        call observed('rot', 4, order_m, order_q)
        call t%close_to('composed-rotations-have-order-4', min(order_m, order_q), 4.0_wp, tolerance_order)
        call observed('rk4', 4, order_m, order_q)
        call t%close_to('classical-runge-kutta-has-order-4', min(order_m, order_q), 4.0_wp, tolerance_order)
        call observed('d-p', 8, order_m, order_q)
        call t%close_to('dormand-prince-has-order-8', min(order_m, order_q), 8.0_wp, 2*tolerance_order)
    end subroutine check_orders

    !> Order seen when the step is halved, in momentum and in attitude.
    subroutine observed(method, order, order_m, order_q)
        character(*), intent(in) :: method
        integer, intent(in) :: order
        real(wp), intent(out) :: order_m, order_q
        real(rk) :: m(3), q(4), m_end(3), q_end(4), errors(2, 2), h
        type(dmv_body) :: body
        integer :: i, n

        body = new_dmv_body(moments)
        m_end = m0
        q_end = identity
        call taylor_flow(moments, 1.0_rk, m_end, q_end)
        do i = 1, 2
            n = 20*i
            h = 1/real(n, rk)
            m = m0
            q = identity
            select case (method)
            case ('dmv')
                call dmv_steps(body, order, h, n, m, q)
            case ('rot')
                call rotation_steps(moments, order, h, n, m, q)
            case ('rk4')
                call rk4_steps(moments, h, n, m, q)
            case default
                call dormand_prince(moments, 1.0_rk, 1.0_rk, m, q, fixed_step=h)
            end select
            errors(i, :) = [norm2(m - m_end), apart(q, q_end)]
        end do
        order_m = real(log(errors(1, 1)/errors(2, 1))/log(2.0_rk), wp)
        order_q = real(log(errors(1, 2)/errors(2, 2))/log(2.0_rk), wp)
    end subroutine observed

    !> Distance of two attitudes, either sign.
    pure function apart(p, q) result(distance)
        real(rk), intent(in) :: p(4), q(4)
        real(rk) :: distance

        distance = min(norm2(p - q), norm2(p + q))
    end function apart

end module frb_test_rivals
