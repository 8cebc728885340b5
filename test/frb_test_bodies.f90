!> Bodies: tensors whose axes are nearly principal, rank, linear rotors, reading a body, pure calls.
module frb_test_bodies
    use frb_checks, only: tally, worst_of
    use frb_flow_samples, only: stream, no_turn, no_rotation
    use frb_free_flow, only: free_flow, rigid_body
    use frb_free_motion, only: free_motion
    use frb_inertia, only: body_core, core_from_moments, principal_axes
    use frb_kinds, only: wp
    use frb_rotations, only: cross, matrix_to_quat, quat_product, quat_rotate, quat_to_matrix
    use frb_status, only: status_ok, status_bad_moments, status_bad_momentum, status_bad_tensor
    use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
    implicit none
    private

    public :: test_bodies

    real(wp), parameter :: eps = epsilon(1.0_wp)
    integer, parameter :: places(2, 3) = reshape([1, 2, 1, 3, 2, 3], [2, 3])

contains

    subroutine test_bodies(t)
        type(tally), intent(inout) :: t

        call t%open_suite('bodies', 23)
        call body_is_read_by_functions(t)
        call nearly_principal_axes(t)
        call rank_of_tensors(t)
        call linear_rotors(t)
        call linear_rotors_of_tensors(t)
        call what_is_no_rotor_is_refused(t)
        call pure_calls(t)
        call what_is_no_rotation(t)
        call t%close_suite()
    end subroutine test_bodies

    subroutine body_is_read_by_functions(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: q(4) = [0.8_wp, -0.4_wp, 0.2_wp, 0.4_wp]
        real(wp) :: tensor(3, 3), axes(3, 3)
        type(rigid_body) :: body
        type(body_core) :: core

        core = core_from_moments([2.0_wp, 6.0_wp, 3.0_wp])
        call t%close_to('differences-of-inverse-moments', [core%alpha, core%beta, core%gamma], &
                        [1/6.0_wp, 1/3.0_wp, 1/6.0_wp], eps/4)
        body = rigid_body([2.0_wp, 6.0_wp, 3.0_wp])
        call t%close_to('moments-of-a-body-are-read-in-their-order', body%moments(), &
                        [2.0_wp, 6.0_wp, 3.0_wp], 0.0_wp)
        tensor = turned_tensor([2.0_wp, 3.0_wp, 6.0_wp], q)
        body = rigid_body(tensor)
        axes = body%axes()
        axes = matmul(axes, matmul(diagonal(body%moments()), transpose(axes)))
        call t%close_to('tensor-is-rebuilt-from-moments-and-axes-of-the-body', reshape(axes, [9]), &
                        reshape(tensor, [9]), 64*eps)
    end subroutine body_is_read_by_functions

    !> Small elements off the diagonal, in every place and of each sign: against the body by moments with its
    !> state turned by hand, and against a Runge-Kutta solution of m' = m x I^-1 m in the tensor's own axes.
    subroutine nearly_principal_axes(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: times(3) = [1.0_wp, 100.0_wp, 1.0e4_wp], m0(3) = [0.3_wp, 0.4_wp, 1.2_wp]
        real(wp) :: tensor(3, 3), worst(3), worst_of_equations, m(3), n(3), q(4), p(4), moments(3), axes(3, 3)
        real(wp) :: small, equations(3)
        type(rigid_body) :: body
        integer :: place, power, sign_of, i

        worst = 0.0_wp
        worst_of_equations = 0.0_wp
        do place = 1, 3
            do power = 4, 17
                do sign_of = -1, 1, 2
                    small = sign_of*10.0_wp**(-power)
                    tensor = diagonal([0.2_wp, 0.9_wp, 1.0_wp])
                    tensor(places(1, place), places(2, place)) = small
                    tensor(places(2, place), places(1, place)) = small
                    body = rigid_body(tensor)
                    call principal_axes(tensor, moments, axes)
                    do i = 1, 3
                        m = m0
                        q = no_turn
                        call free_flow(body, times(i), m, q)
                        n = matmul(m0, axes)
                        p = matrix_to_quat(axes)
                        call free_flow(rigid_body(moments), times(i), n, p)
                        p = quat_product(p, matrix_to_quat(transpose(axes)))
                        worst(i) = worst_of(worst(i), [norm2(m - matmul(axes, n)), &
                                                       min(norm2(p - q), norm2(p + q))])
                    end do
                    equations = by_equations(tensor, m0, 1.0_wp)
                    m = m0
                    call free_flow(body, 1.0_wp, m)
                    worst_of_equations = worst_of(worst_of_equations, norm2(m - equations))
                end do
            end do
        end do
        call t%at_most('nearly-principal-axes-move-as-principal-ones-do-after-1', worst(1), 2.0e-15_wp)
        call t%at_most('nearly-principal-axes-move-as-principal-ones-do-after-100', worst(2), 1.0e-13_wp)
        call t%at_most('nearly-principal-axes-move-as-principal-ones-do-after-1e4', worst(3), 1.0e-11_wp)
        call t%at_most('nearly-principal-axes-obey-the-equations-of-motion', worst_of_equations, 1.0e-13_wp)
    end subroutine nearly_principal_axes

    !> The rank of a tensor is measured against its largest moment: the same in every direction and unit.
    subroutine rank_of_tensors(t)
        type(tally), intent(inout) :: t
        type(stream) :: random
        type(rigid_body) :: rod, flat, thin, negative
        real(wp) :: q(4), units
        integer :: i, rods, refused, bodies

        rods = 0
        refused = 0
        bodies = 0
        do i = 1, 1000
            q = random_turn(random)
            units = merge(1.0_wp, random%log_uniform(-100.0_wp, 100.0_wp), i <= 500)
            rod = rigid_body(units*turned_tensor([0.0_wp, 1.0_wp, 1.0_wp], q))
            flat = rigid_body(units*turned_tensor([0.0_wp, 1.0_wp, 2.0_wp], q))
            negative = rigid_body(units*turned_tensor([-1.0e-10_wp, 1.0_wp, 1.0_wp], q))
            thin = rigid_body(units*turned_tensor([1.0e-13_wp, 1.0_wp, 1.0_wp], q))
            if (rod%is_linear() .and. rod%status() == status_ok) rods = rods + 1
            refused = refused + count([all([flat%status(), negative%status()] == status_bad_tensor)])
            if (thin%status() == status_ok .and. .not. thin%is_linear()) bodies = bodies + 1
        end do
        call t%equal('rod-by-its-tensor-is-linear-in-every-direction', rods, 1000)
        call t%equal('other-tensors-of-rank-two-are-refused-in-every-direction', refused, 1000)
        call t%equal('thin-body-is-no-rod-in-any-direction', bodies, 1000)
        rod = rigid_body(diagonal([0.3_wp, 1.0e-20_wp, 0.3_wp]))
        call t%ok('rank-of-a-diagonal-tensor-is-judged-alike', rod%is_linear())
    end subroutine rank_of_tensors

    !> A linear rotor turns about its momentum by |m| h/I; the momentum stays.
    subroutine linear_rotors(t)
        type(tally), intent(inout) :: t
        type(stream) :: random
        type(rigid_body) :: body
        type(free_motion) :: motion
        real(wp) :: moments(3), m0(3), m(3), q0(4), q(4), n(3), p(4), a(3, 3), h, many_m(3, 30), many_q(4, 30)
        real(wp) :: worst, worst_m, worst_many, worst_other, unit_error
        integer :: i, j, zero, stat

        worst = 0.0_wp
        worst_m = 0.0_wp
        worst_many = 0.0_wp
        worst_other = 0.0_wp
        do i = 1, 300
            zero = 1 + mod(i, 3)
            moments = random%log_uniform(-10.0_wp, 10.0_wp)
            moments(zero) = 0.0_wp
            body = rigid_body(moments)
            m0 = random%direction()
            m0(zero) = 0.0_wp
            q0 = random_turn(random)
            h = random%log_uniform(-3.0_wp, 3.0_wp)*maxval(moments)
            m = m0
            q = q0
            call free_flow(body, h, m, q, stat)
            p = turn_about_momentum(q0, m0, h/maxval(moments))
            ! The inherent sensitivity: the angle and the two factors, each with a rounding.
            unit_error = 0.5_wp*eps*(2 + abs(h)*norm2(m0)/maxval(moments))
            worst = worst_of(worst, [norm2(q - p)/unit_error, real(stat, wp)])
            worst_m = worst_of(worst_m, norm2(m - m0))
            do j = 1, 30
                many_m(:, j) = m0
                many_q(:, j) = q0
            end do
            call free_flow(body, h, many_m, many_q, stat)
            worst_many = worst_of(worst_many, [norm2(many_q - spread(q, 2, 30)), &
                                               norm2(many_m - spread(m0, 2, 30)), real(stat, wp)])
            n = m0
            a = quat_to_matrix(q0)
            call free_flow(body, h, n, a, stat)
            worst_other = worst_of(worst_other, [norm2(a - quat_to_matrix(p))/unit_error, real(stat, wp)])
            motion = free_motion(body, m0, q0)
            call motion%at(h, n, p, stat)
            worst_other = worst_of(worst_other, [norm2(q - p)/eps, real(stat, wp)])
        end do
        call t%at_most('linear-rotor-turns-about-its-momentum', worst, 2.0_wp)
        call t%at_most('momentum-of-a-linear-rotor-stays-to-the-bit', worst_m, 0.0_wp)
        call t%at_most('linear-rotors-in-a-batch-move-as-one', worst_many, 1.0e-14_wp)
        call t%at_most('linear-rotor-with-a-matrix-and-as-a-motion', worst_other, 16.0_wp)
    end subroutine linear_rotors

    !> Rods in any direction: the motion over many steps, and that momentum along the axis is taken out.
    subroutine linear_rotors_of_tensors(t)
        type(tally), intent(inout) :: t
        type(stream) :: random
        type(rigid_body) :: body
        real(wp) :: q0(4), q(4), m0(3), m(3), axis(3), worst, along
        integer :: i, step, stat

        worst = 0.0_wp
        along = 0.0_wp
        do i = 1, 20
            q0 = random_turn(random)
            body = rigid_body(turned_tensor([0.0_wp, 2.0_wp, 2.0_wp], q0))
            axis = quat_rotate(q0, [1.0_wp, 0.0_wp, 0.0_wp])
            m0 = cross(axis, random%direction())
            m = m0 + 3.0e-12_wp*axis
            q = no_turn
            call free_flow(body, 0.1_wp, m, q, stat)
            along = worst_of(along, [abs(dot_product(m, axis)), real(stat, wp)])
            m = m0
            q = no_turn
            do step = 1, 10000
                call free_flow(body, 0.1_wp, m, q, stat)
            end do
            worst = worst_of(worst, [norm2(m - m0), abs(norm2(q) - 1), &
                                     norm2(q - turn_about_momentum(no_turn, m0, 500.0_wp)), &
                                     real(stat, wp)])
        end do
        call t%at_most('momentum-along-the-axis-of-a-rod-is-taken-out', along, 4*eps)
        call t%at_most('rods-in-any-direction-keep-what-bodies-keep', worst, 2.0e-12_wp)
    end subroutine linear_rotors_of_tensors

    subroutine what_is_no_rotor_is_refused(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: wrong(3, 5) = reshape([0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 2.0_wp, &
                                                      0.0_wp, 0.0_wp, 1.0_wp, 1.0_wp, -1.0_wp, 1.0_wp, &
                                                      1.0e-310_wp, 1.0_wp, 1.0_wp], [3, 5])
        type(rigid_body) :: body
        real(wp) :: m(3), q(4)
        integer :: i, stat, refused

        refused = 0
        do i = 1, 5
            body = rigid_body(wrong(:, i))
            if (body%status() == status_bad_moments) refused = refused + 1
        end do
        call t%equal('zero-moments-that-are-no-rotor-are-refused', refused, 5)
        body = rigid_body(0.0_wp*no_rotation)
        call t%equal('zero-tensor-is-refused', body%status(), status_bad_tensor)
        body = rigid_body([1.0_wp, 0.0_wp, 1.0_wp])
        m = [0.5_wp, 1.0e-7_wp, 0.5_wp]
        q = no_turn
        call free_flow(body, 1.0_wp, m, q, stat)
        call t%ok('momentum-along-the-axis-of-a-rotor-is-refused', stat == status_bad_momentum &
                  .and. all(abs(m - [0.5_wp, 1.0e-7_wp, 0.5_wp]) <= 0.0_wp) &
                  .and. all(abs(q - no_turn) <= 0.0_wp))
    end subroutine what_is_no_rotor_is_refused

    !> With `stat` the flow of one body can be called from pure procedures and from do concurrent.
    subroutine pure_calls(t)
        type(tally), intent(inout) :: t
        type(rigid_body) :: body
        real(wp) :: m(3, 10), q(4, 10), a(3, 3), alone(3), p(4)
        integer :: i, stats(10), stat

        body = rigid_body([1.0_wp, 1.5_wp, 2.2_wp])
        do i = 1, 10
            m(:, i) = [0.1_wp*i, 1.0_wp, -0.3_wp]
            q(:, i) = no_turn
        end do
        do concurrent (i = 1:10)
            call free_flow(body, 0.7_wp, m(:, i), q(:, i), stats(i))
        end do
        alone = [1.0_wp, 1.0_wp, -0.3_wp]
        p = no_turn
        call free_flow(body, 0.7_wp, alone, p)
        call t%close_to('flow-in-do-concurrent', [m(:, 10), q(:, 10), real(stats, wp)], &
                        [alone, p, spread(0.0_wp, 1, 10)], 0.0_wp)
        a = no_rotation
        alone = [1.0_wp, 1.0_wp, -0.3_wp]
        call free_flow(body, 0.7_wp, alone, a, stat)
        call t%close_to('flow-in-a-pure-function', momentum_after(body, 0.7_wp, [1.0_wp, 1.0_wp, -0.3_wp]), &
                        alone, 2*eps)
    end subroutine pure_calls

    pure function momentum_after(body, h, m0) result(m)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h, m0(3)
        real(wp) :: m(3)
        integer :: stat

        m = m0
        call free_flow(body, h, m, stat)
    end function momentum_after

    !> A reflection, a scaled rotation and a shear have no quaternion.
    subroutine what_is_no_rotation(t)
        type(tally), intent(inout) :: t
        real(wp) :: shear(3, 3)

        shear = no_rotation
        shear(1, 2) = 1.0e-3_wp
        call t%ok('matrix-that-is-no-rotation-has-no-quaternion', all(ieee_is_nan([ &
            matrix_to_quat(diagonal([1.0_wp, 1.0_wp, -1.0_wp])), matrix_to_quat(-no_rotation), &
            matrix_to_quat(2*no_rotation), matrix_to_quat(0*no_rotation), matrix_to_quat(shear)])))
    end subroutine what_is_no_rotation

    pure function diagonal(elements) result(matrix)
        real(wp), intent(in) :: elements(3)
        real(wp) :: matrix(3, 3)
        integer :: i

        matrix = 0.0_wp
        do i = 1, 3
            matrix(i, i) = elements(i)
        end do
    end function diagonal

    !> R diag(moments) R^T, symmetric to the bit.
    pure function turned_tensor(moments, q) result(tensor)
        real(wp), intent(in) :: moments(3), q(4)
        real(wp) :: tensor(3, 3)

        tensor = matmul(quat_to_matrix(q), matmul(diagonal(moments), transpose(quat_to_matrix(q))))
        tensor = 0.5_wp*(tensor + transpose(tensor))
    end function turned_tensor

    function random_turn(random) result(q)
        type(stream), intent(inout) :: random
        real(wp) :: q(4)
        real(wp) :: angle

        angle = random%uniform(0.0_wp, 3.0_wp)
        q = [cos(angle), sin(angle)*random%direction()]
    end function random_turn

    !> q after a turn with the angular velocity m h/I, as h_over_i = h/I.
    pure function turn_about_momentum(q, m, h_over_i) result(turned)
        real(wp), intent(in) :: q(4), m(3), h_over_i
        real(wp) :: turned(4)
        real(wp) :: angle

        angle = 0.5_wp*norm2(m)*h_over_i
        turned = quat_product(q, [cos(angle), sin(angle)*m/norm2(m)])
    end function turn_about_momentum

    !> m(t) by 4000 steps of the classical Runge-Kutta method.
    pure function by_equations(tensor, m0, t) result(m)
        real(wp), intent(in) :: tensor(3, 3), m0(3), t
        real(wp) :: m(3)
        integer, parameter :: steps = 4000
        real(wp) :: inverse(3, 3), h, k1(3), k2(3), k3(3), k4(3)
        integer :: i

        do i = 1, 3
            inverse(i, :) = cross(tensor(:, 1 + mod(i, 3)), tensor(:, 1 + mod(i + 1, 3)))
        end do
        inverse = inverse/dot_product(inverse(1, :), tensor(:, 1))
        h = t/steps
        m = m0
        do i = 1, steps
            k1 = cross(m, matmul(inverse, m))
            k2 = m + 0.5_wp*h*k1
            k2 = cross(k2, matmul(inverse, k2))
            k3 = m + 0.5_wp*h*k2
            k3 = cross(k3, matmul(inverse, k3))
            k4 = m + h*k3
            k4 = cross(k4, matmul(inverse, k4))
            m = m + h/6*(k1 + 2*k2 + 2*k3 + k4)
        end do
    end function by_equations

end module frb_test_bodies
