!> frb_step and quat_step in many steps: the order of the semi-exact ones, a heavy top.
module frb_test_step_orders
    use frb_checks, only: tally, largest
    use frb_flow_samples, only: no_rotation, no_turn
    use frb_kinds, only: wp
    use frb_matrix_step, only: frb_step
    use frb_quat_step, only: quat_step
    use frb_rotations, only: quat_to_matrix
    use frb_torque_cases, only: top_case, known_top, papers_m_after_one_step, papers_m_at_5000
    implicit none
    private

    public :: test_step_orders

contains

    subroutine test_step_orders(t)
        type(tally), intent(inout) :: t

        call t%open_suite('step-orders', 18)
        call check_order(t)
        call check_heavy_top(t)
        call t%close_suite()
    end subroutine test_step_orders

    !> Order 2 np over [0, 4], in 16 and 32 steps.
    subroutine check_order(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: moments(3) = [0.345_wp, 0.653_wp, 1.0_wp], m0(3) = [0.5_wp, 0.9_wp, 0.8_wp]
        real(wp) :: error(2), m(3), q(4), exact(4), a(3, 3)
        integer :: np, frame, i, j

        call quat_step(m, exact, 4.0_wp, moments, m0, no_turn)
        do np = 1, 4
            do frame = 0, 3
                do i = 1, 2
                    m = m0
                    q = no_turn
                    a = no_rotation
                    do j = 1, 16*i
                        if (frame == 0) then
                            call frb_step(m, a, 0.25_wp/i, moments, m, a, np)
                        else
                            call quat_step(m, q, 0.25_wp/i, moments, m, q, np, frame)
                        end if
                    end do
                    error(i) = min(largest(abs(q - exact)), largest(abs(q + exact)))
                    if (frame == 0) error(i) = largest([abs(a - quat_to_matrix(exact))])
                end do
                call t%close_to('order-is-twice-the-number-of-points: '//achar(48 + np)//', frame '// &
                                achar(48 + frame), &
                                log(error(1)/error(2))/log(2.0_wp), real(2*np, wp), 0.25_wp)
            end do
        end do
    end subroutine check_order

    !> The paper's section 4.3: the heavy top by the splitting (23), with the corrected a_4, against the
    !> published output after one step and at t = 5000 (published with the misprinted a_4, hence 1e-8).
    subroutine check_heavy_top(t)
        type(tally), intent(inout) :: t
        type(top_case) :: top
        real(wp) :: moments(3), u0(3), m(3), a(3, 3)
        integer :: i

        top = known_top(1)
        moments = top%body%moments()
        u0 = top%top%force
        m = top%m0
        a = no_rotation
        call split_step(m, a)
        call t%close_to('heavy-top-after-one-step', m, papers_m_after_one_step, 1.0e-13_wp)
        do i = 2, 10000
            call split_step(m, a)
        end do
        call t%close_to('heavy-top-at-5000', m, papers_m_at_5000, 1.0e-8_wp)

    contains

        subroutine split_step(m, a)
            real(wp), intent(inout) :: m(3), a(3, 3)
            real(wp), parameter :: drift_half(7) = [ &
                0.0378593198406116_wp, 0.102635633102435_wp, -0.0258678882665587_wp, 0.314241403071447_wp, &
                -0.130144459517415_wp, 0.106417700369543_wp, -0.00879424312851058_wp]
            real(wp), parameter :: kick_half(6) = [ &
                0.09171915262446165_wp, 0.183983170005006_wp, -0.05653436583288827_wp, &
                0.004914688774712854_wp, 0.143761127168358_wp, 0.328567693746804_wp]
            real(wp), parameter :: h = 0.5_wp
            real(wp) :: drift(8), kick(7), u(3)
            integer :: k

            drift = [drift_half, 1 - 2*sum(drift_half)]
            kick = [kick_half, 0.5_wp - sum(kick_half)]
            do k = 1, 14
                call frb_step(m, a, drift(min(k, 16 - k))*h, moments, m, a)
                u = matmul(u0, a)
                m(1) = m(1) + kick(min(k, 15 - k))*h*u(2)
                m(2) = m(2) - kick(min(k, 15 - k))*h*u(1)
            end do
            call frb_step(m, a, drift(1)*h, moments, m, a)
        end subroutine split_step

    end subroutine check_heavy_top

end module frb_test_step_orders
