!> frb_step and quat_step: the laws any flow of the free rigid body obeys.
module frb_test_step_laws
    use frb_checks, only: tally, largest, worst_of
    use frb_claims, only: chain_norms, chain_space
    use frb_flow_samples, only: sample, random_samples, diagonal, no_rotation, no_turn
    use frb_inertia, only: principal_axes
    use frb_kinds, only: wp
    use frb_matrix_step, only: frb_step
    use frb_quat_step, only: quat_step
    use frb_rotations, only: quat_to_matrix, quat_rotate, norm3
    implicit none
    private

    public :: test_step_laws

    real(wp), parameter :: eps = epsilon(1.0_wp)
    !> Largest difference over the random motions below: two steps, at most one orbit long each, bodies away
    !> from no special case.
    real(wp), parameter :: two_steps = 4000*eps

contains

    subroutine test_step_laws(t)
        type(tally), intent(inout) :: t
        type(sample), allocatable :: samples(:)

        call t%open_suite('step-laws', 23)
        samples = random_samples(300)
        call check_flow(t, samples)
        call check_relabelling(t, samples)
        call check_scaling(t, samples)
        call check_tensor(t, samples)
        call check_quadrature(t, samples)
        call check_conservation(t)
        call check_continuity(t)
        call check_separatrix(t)
        call t%close_suite()
    end subroutine test_step_laws

    !> Group law, reversal, matrix against quaternion, the three frames.
    subroutine check_flow(t, samples)
        type(tally), intent(inout) :: t
        type(sample), intent(in) :: samples(:)
        real(wp) :: group(0:3), back(0:3), frames(3), m(3), m1(3), a(3, 3), a1(3, 3), q(4), q1(4)
        integer :: i, frame

        group = 0.0_wp
        back = 0.0_wp
        frames = 0.0_wp
        do i = 1, size(samples)
            associate (it => samples(i))
                call frb_step(m1, a1, it%h, it%moments, it%m, quat_to_matrix(it%q))
                call frb_step(m, a, 0.3_wp*it%h, it%moments, it%m, quat_to_matrix(it%q))
                call frb_step(m, a, it%h - 0.3_wp*it%h, it%moments, m, a)
                group(0) = worst_of(group(0), [abs(m - m1), abs(a - a1)])
                call frb_step(m, a, -it%h, it%moments, m1, a1)
                back(0) = worst_of(back(0), [abs(m - it%m), abs(a - quat_to_matrix(it%q))])
                do frame = 1, 3
                    call quat_step(m1, q1, it%h, it%moments, it%m, it%q, frame=frame)
                    frames(frame) = worst_of(frames(frame), [abs(quat_to_matrix(q1) - a1)])
                    call quat_step(m, q, 0.3_wp*it%h, it%moments, it%m, it%q, frame=frame)
                    call quat_step(m, q, it%h - 0.3_wp*it%h, it%moments, m, q, frame=frame)
                    group(frame) = worst_of(group(frame), [abs(m - m1), abs(q - q1)])
                    call quat_step(m, q, -it%h, it%moments, m1, q1, frame=frame)
                    back(frame) = worst_of(back(frame), [abs(m - it%m), abs(q - it%q)])
                end do
            end associate
        end do
        call t%at_most('two-steps-equal-one-step-of-their-sum', group(0), two_steps)
        call t%at_most('two-quaternion-steps-equal-one-with-its-sign', largest(group(1:)), two_steps)
        call t%at_most('step-back-returns-the-start', back(0), two_steps)
        call t%at_most('quaternion-step-back-returns-the-start-with-its-sign', largest(back(1:)), two_steps)
        call t%at_most('matrix-and-quaternion-agree', frames(1), two_steps)
        call t%at_most('frame-2-agrees', frames(2), two_steps)
        call t%at_most('frame-3-agrees', frames(3), two_steps)
    end subroutine check_flow

    !> Other names for the axes: every permutation, odd ones with a reflection made a rotation by a sign.
    subroutine check_relabelling(t, samples)
        type(tally), intent(inout) :: t
        type(sample), intent(in) :: samples(:)
        integer, parameter :: orders(3, 6) = reshape([1, 2, 3, 2, 3, 1, 3, 1, 2, &
                                                         2, 1, 3, 1, 3, 2, 3, 2, 1], [3, 6])
        real(wp) :: m(3), q(4), a(3, 3), mm(3), qq(4), aa(3, 3), sense, worst(2)
        integer :: i, k

        worst = 0.0_wp
        do i = 1, size(samples)
            associate (it => samples(i))
                call quat_step(m, q, it%h, it%moments, it%m, no_turn)
                call frb_step(m, a, it%h, it%moments, it%m, no_rotation)
                do k = 2, 6
                    sense = merge(1.0_wp, -1.0_wp, k <= 3)
                    call quat_step(mm, qq, it%h, it%moments(orders(:, k)), sense*it%m(orders(:, k)), no_turn)
                    worst(1) = worst_of(worst(1), [abs(mm - sense*m(orders(:, k))), &
                                   abs(qq - [q(1), sense*q(1 + orders(:, k))])])
                    call frb_step(mm, aa, it%h, it%moments(orders(:, k)), sense*it%m(orders(:, k)), &
                                  no_rotation)
                    worst(2) = worst_of(worst(2), [abs(mm - sense*m(orders(:, k))), &
                                   abs(aa - a(orders(:, k), orders(:, k)))])
                end do
            end associate
        end do
        call t%at_most('relabelled-axes-give-relabelled-quaternions', worst(1), 64*eps)
        call t%at_most('relabelled-axes-give-relabelled-matrices', worst(2), 64*eps)
    end subroutine check_relabelling

    !> Units: momentum times g with time over g; moments times g with time times g; |q| and Q carried along.
    subroutine check_scaling(t, samples)
        type(tally), intent(inout) :: t
        type(sample), intent(in) :: samples(:)
        real(wp), parameter :: factors(4) = [2.0_wp**40, 2.0_wp**(-40), 2.0_wp**900, 2.0_wp**(-900)]
        real(wp) :: m(3), q(4), mm(3), qq(4), worst(3)
        integer :: i, j

        worst = 0.0_wp
        do i = 1, size(samples), 10
            associate (it => samples(i))
                call quat_step(m, q, it%h, it%moments, it%m, it%q)
                do j = 1, size(factors)
                    call quat_step(mm, qq, it%h/factors(j), it%moments, it%m*factors(j), it%q)
                    worst(1) = worst_of(worst(1), [abs(mm/factors(j) - m), abs(qq - q)])
                    call quat_step(mm, qq, it%h*factors(j), it%moments*factors(j), it%m, it%q)
                    worst(2) = worst_of(worst(2), [abs(mm - m), abs(qq - q)])
                end do
                call quat_step(mm, qq, it%h, it%moments, it%m, 4*it%q)
                worst(3) = worst_of(worst(3), [abs(qq - 4*q)])
            end associate
        end do
        call t%at_most('momentum-scales-as-one-over-time', worst(1), 64*eps)
        call t%at_most('moments-scale-as-time', worst(2), 64*eps)
        call t%at_most('norm-of-the-quaternion-is-carried-along', worst(3), 0.0_wp)
    end subroutine check_scaling

    !> A body whose axes are not principal: steps in the axes that `principal_axes` finds, and back.
    subroutine check_tensor(t, samples)
        type(tally), intent(inout) :: t
        type(sample), intent(in) :: samples(:)
        real(wp) :: turn(3, 3), tensor(3, 3), moments(3), axes(3, 3), m(3), a(3, 3), m1(3), a1(3, 3), worst
        integer :: i, stat

        worst = 0.0_wp
        do i = 1, size(samples)
            associate (it => samples(i))
                turn = quat_to_matrix(it%q)
                tensor = matmul(turn, matmul(diagonal(it%moments), transpose(turn)))
                tensor = 0.5_wp*(tensor + transpose(tensor))
                call principal_axes(tensor, moments, axes, stat)
                call frb_step(m, a, it%h, moments, matmul(matmul(turn, it%m), axes), axes, stat=stat)
                ! the same motion, in the axes of the sample
                call frb_step(m1, a1, it%h, it%moments, it%m, turn)
                worst = worst_of(worst, [abs(matmul(axes, m) - matmul(turn, m1)), &
                            abs(matmul(a, transpose(axes)) - matmul(a1, transpose(turn)))])
            end associate
        end do
        call t%at_most('tensor-moves-as-its-principal-moments', worst, two_steps)
    end subroutine check_tensor

    !> Semi-exact steps: the momentum is exact, the step is symmetric in time, many points are exact.
    subroutine check_quadrature(t, samples)
        type(tally), intent(inout) :: t
        type(sample), intent(in) :: samples(:)
        real(wp) :: m(3), m1(3), q(4), q1(4), a(3, 3), momentum, back, points, space, norm
        integer :: i, frame

        momentum = 0.0_wp
        back = 0.0_wp
        points = 0.0_wp
        space = 0.0_wp
        do i = 1, size(samples)
            associate (it => samples(i))
                do frame = 1, 3
                    call quat_step(m, q, it%h, it%moments, it%m, no_turn, 0, frame)
                    call quat_step(m1, q1, it%h, it%moments, it%m, no_turn, 2, frame)
                    norm = norm3(it%m)
                    momentum = worst_of(momentum, abs(m - m1)/norm)
                    space = worst_of(space, norm3(quat_rotate(q1, m1) - it%m)/norm)
                    call quat_step(m1, q1, -it%h, it%moments, m1, q1, 2, frame)
                    back = worst_of(back, min(largest(abs(q1 - no_turn)), largest(abs(q1 + no_turn))))
                    call quat_step(m1, q1, 0.1_wp*it%h, it%moments, it%m, no_turn, 60, frame)
                    call quat_step(m, q, 0.1_wp*it%h, it%moments, it%m, no_turn, 0, frame)
                    points = worst_of(points, [abs(q1 - q)])
                end do
                call frb_step(m1, a, it%h, it%moments, it%m, no_rotation, 1)
                space = worst_of(space, norm3(matmul(a, m1) - it%m)/norm)
            end associate
        end do
        call t%at_most('semi-exact-momentum-is-exact', momentum, two_steps)
        call t%at_most('semi-exact-step-back-returns-the-start', back, two_steps)
        call t%at_most('semi-exact-space-momentum-is-constant', space, 64*eps)
        call t%at_most('sixty-points-are-exact', points, two_steps)
    end subroutine check_quadrature

    !> 20 000 steps, short ones with the matrix, long ones with the quaternion in each frame: |m|, energy,
    !> momentum in space, orthogonality.
    subroutine check_conservation(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: moments(3) = [0.6_wp, 0.8_wp, 1.0_wp], m0(3) = [0.5_wp, -0.9_wp, 0.8_wp]
        real(wp) :: m(3), q(4), a(3, 3), norm, energy, space, defect
        integer :: i, frame

        m = m0
        a = no_rotation
        do i = 1, 20000
            call frb_step(m, a, 0.1_wp, moments, m, a)
        end do
        norm = abs(norm3(m)/norm3(m0) - 1)
        energy = abs(sum(m**2/moments)/sum(m0**2/moments) - 1)
        space = norm3(matmul(a, m) - m0)
        defect = largest([abs(matmul(transpose(a), a) - no_rotation)])
        do frame = 1, 3
            m = m0
            q = no_turn
            do i = 1, 20000
                call quat_step(m, q, 1.0_wp, moments, m, q, frame=frame)
            end do
            norm = worst_of(norm, abs(norm3(m)/norm3(m0) - 1))
            energy = worst_of(energy, abs(sum(m**2/moments)/sum(m0**2/moments) - 1))
            space = worst_of(space, norm3(quat_rotate(q, m) - m0))
            defect = worst_of(defect, abs(sqrt(sum(q**2)) - 1))
        end do
        call t%at_most('norm-of-the-momentum-is-constant', norm, chain_norms)
        call t%at_most('energy-is-constant', energy, chain_norms)
        call t%at_most('space-momentum-is-constant', space, chain_space)
        call t%at_most('attitude-stays-orthogonal-and-unit', defect, chain_norms)
    end subroutine check_conservation

    !> q(h) is continuous in h over many periods, in each frame and both cases of the motion.
    subroutine check_continuity(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: moments(3) = [0.4_wp, 0.7_wp, 1.0_wp]
        real(wp), parameter :: starts(3, 4) = reshape([0.9_wp, 0.3_wp, 0.2_wp, 0.2_wp, 0.3_wp, 0.9_wp, &
                                                       -0.9_wp, 0.3_wp, 0.2_wp, 0.2_wp, 0.3_wp, -0.9_wp], &
                                                      [3, 4])
        real(wp) :: m(3), q(4), last(4), jump
        integer :: i, start, frame

        jump = 0.0_wp
        do start = 1, 4
            do frame = 1, 3
                last = no_turn
                do i = -2000, 2000
                    call quat_step(m, q, 0.05_wp*i, moments, starts(:, start), no_turn, frame=frame)
                    if (i > -2000) jump = worst_of(jump, [abs(q - last)])
                    last = q
                end do
            end do
        end do
        call t%at_most('quaternion-is-continuous-over-many-periods', jump, 0.1_wp)
    end subroutine check_continuity

    !> From both sides of the separatrix and on it, for steps up to h = 1e8: finite, on the orbit.
    subroutine check_separatrix(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: moments(3) = [2.0_wp, 3.0_wp, 6.0_wp]
        real(wp) :: m0(3), m(3), q(4), a(3, 3), worst
        integer :: i, j, frame

        worst = 0.0_wp
        do i = -16, 16
            m0 = [0.4_wp, -0.8_wp, 0.4_wp]
            if (i /= 0) m0(1) = m0(1)*(1 + sign(10.0_wp**(-abs(i)), real(i, wp)))
            do j = -8, 40
                call frb_step(m, a, 10.0_wp**(0.2_wp*j), moments, m0, no_rotation)
                worst = worst_of(worst, [abs(norm3(m)/norm3(m0) - 1), norm3(matmul(a, m) - m0), &
                            abs(sum(m**2/moments)/sum(m0**2/moments) - 1), &
                            abs(matmul(transpose(a), a) - no_rotation)])
                do frame = 1, 3
                    call quat_step(m, q, -10.0_wp**(0.2_wp*j), moments, m0, no_turn, frame=frame)
                    worst = worst_of(worst, [abs(norm3(m)/norm3(m0) - 1), norm3(quat_rotate(q, m) - m0), &
                                abs(sum(m**2/moments)/sum(m0**2/moments) - 1), abs(sqrt(sum(q**2)) - 1)])
                end do
            end do
        end do
        call t%at_most('near-separatrix-stays-on-its-orbit', worst, 64*eps)
    end subroutine check_separatrix

end module frb_test_step_laws
