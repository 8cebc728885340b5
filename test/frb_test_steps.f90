!> frb_step and quat_step: accuracy against references, special motions, extremes, refused input.
module frb_test_steps
    use frb_checks, only: tally, largest, worst_of
    use frb_claims, only: matrix_median, matrix_largest, frame_median, frame_largest, orthogonal
    use frb_flow_samples, only: no_rotation, no_turn
    use frb_kinds, only: wp
    use frb_matrix_step, only: frb_step
    use frb_quat_step, only: quat_step
    use frb_reference_cases, only: reference_case, read_cases, score_momentum, score_attitude, median
    use frb_rotations, only: matrix_to_quat, quat_to_matrix, norm3
    use frb_status, only: status_ok, status_bad_moments, status_bad_momentum, status_bad_attitude, &
        status_bad_time, status_bad_count, status_bad_option
    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan, ieee_positive_inf, ieee_is_finite
    implicit none
    private

    public :: test_steps

    real(wp), parameter :: eps = epsilon(1.0_wp)

    !> Median and maximum of the scores in every group, of momentum, matrix, quaternion in each frame.
    real(wp), parameter :: units_matrix(2) = [matrix_median, matrix_largest]
    real(wp), parameter :: units_frame(2) = [frame_median, frame_largest]

contains

    subroutine test_steps(t)
        type(tally), intent(inout) :: t

        call t%open_suite('steps', 121)
        call check_reference_cases(t)
        call check_published_ends(t)
        call check_special_motions(t)
        call check_extremes(t)
        call check_same_variable(t)
        call check_refusals(t)
        call t%close_suite()
    end subroutine test_steps

    !> Every group of data/reference: momentum, and attitude of the matrix and of the three frames.
    subroutine check_reference_cases(t)
        type(tally), intent(inout) :: t
        type(reference_case), allocatable :: cases(:)
        real(wp), allocatable :: score(:, :)
        real(wp) :: m(3), a(3, 3), q(4), defect
        integer :: i, frame
        character(:), allocatable :: group

        call read_cases('data/reference/cases.txt', cases)
        allocate (score(size(cases), 5))
        defect = 0.0_wp
        do i = 1, size(cases)
            call frb_step(m, a, cases(i)%h, cases(i)%moments, cases(i)%m0, no_rotation)
            score(i, 1) = score_momentum(cases(i), m)
            score(i, 2) = score_attitude(cases(i), matrix_to_quat(a))
            defect = worst_of(defect, [abs(matmul(transpose(a), a) - no_rotation)])
            do frame = 1, 3
                call quat_step(m, q, cases(i)%h, cases(i)%moments, cases(i)%m0, no_turn, frame=frame)
                score(i, 1) = worst_of(score(i, 1), score_momentum(cases(i), m))
                score(i, 2 + frame) = score_attitude(cases(i), q)
                defect = worst_of(defect, abs(sqrt(sum(q**2)) - 1))
            end do
        end do
        call t%equal('all-reference-cases-are-read', size(cases), 325)
        call t%at_most('attitude-is-orthogonal-or-unit', defect, orthogonal)
        do i = 1, size(cases)
            group = trim(cases(i)%group)
            if (i > 1) then
                if (any(cases(:i - 1)%group == group)) cycle
            end if
            associate (inside => cases%group == group)
                call check_scores(t, group//': momentum', pack(score(:, 1), inside), units_matrix)
                call check_scores(t, group//': matrix', pack(score(:, 2), inside), units_matrix)
                do frame = 1, 3
                    call check_scores(t, group//': quaternion-in-frame-'//achar(48 + frame), &
                                      pack(score(:, 2 + frame), inside), units_frame)
                end do
            end associate
        end do
    end subroutine check_reference_cases

    subroutine check_scores(t, name, scores, units)
        type(tally), intent(inout) :: t
        character(*), intent(in) :: name
        real(wp), intent(in) :: scores(:), units(2)

        ! one check for both: the larger of median and maximum, each over its bound
        call t%at_most(name//'-is-within-its-units', &
                       largest([median(scores)/units(1), scores/units(2)]), 1.0_wp)
    end subroutine check_scores

    !> Published end values (30-digit Taylor series): free bodies of Hairer and Vilmart, tennis racket.
    subroutine check_published_ends(t)
        type(tally), intent(inout) :: t

        call check_end(t, 'asymmetric-body-at-10', [0.6_wp, 0.8_wp, 1.0_wp], [1.8_wp, 0.4_wp, -0.9_wp], &
                       10.0_wp, &
                       [1.765962508518207535727150482_wp, -0.6954641970330891194994927568_wp, &
                        0.7795549814818710861007417738_wp], &
                       [-0.7360613641607939361612411474_wp, -0.5707869512403507332546212462_wp, &
                        -0.2993885718307900937437669433_wp, -0.2068390861046731924831171081_wp], 256.0_wp)
        call check_end(t, 'flat-body-at-10', [0.345_wp, 0.653_wp, 1.0_wp], [1.8_wp, 0.4_wp, -0.9_wp], &
                       10.0_wp, &
                       [1.805748694153316944124664435_wp, -0.2931590700520223516263628767_wp, &
                        0.9291552148106494226863761060_wp], &
                       [-0.5909531300598776824030520653_wp, 0.7497771466036242986823664977_wp, &
                        -0.2775673505986917899234931261_wp, -0.1075406638671320485487867749_wp], 256.0_wp)
        call check_end(t, 'tennis-racket-at-100', [3.0_wp, 5.0_wp, 9.0_wp], [0.0_wp, 2.0_wp, 0.01_wp], &
                       100.0_wp, &
                       [0.2090942628297760675113266181_wp, 1.972485481094647073085859142_wp, &
                        0.2562822977158024670448625624_wp], &
                       [0.9729650346542738322786753128_wp, -0.07171372908301691046137617088_wp, &
                        -0.2164463177188846447851642727_wp, 0.03670386828593163761549255816_wp], 3.0e4_wp)
    end subroutine check_published_ends

    subroutine check_end(t, name, moments, m0, time, m_end, q_end, sensitivity)
        type(tally), intent(inout) :: t
        character(*), intent(in) :: name
        real(wp), intent(in) :: moments(3), m0(3), time, m_end(3), q_end(4)
        real(wp), intent(in) :: sensitivity     !! effect of rounding in the steps, in roundings of the result
        real(wp) :: m(3), q(4), a(3, 3)
        integer :: i

        call quat_step(m, q, time, moments, m0, no_turn)
        call t%close_to(name//'-in-one-step-with-its-sign', [m, q], [m_end, q_end], 256*eps)
        m = m0
        a = no_rotation
        do i = 1, 64
            call frb_step(m, a, time/64, moments, m, a)
        end do
        call t%close_to(name//'-in-64-steps', [m, reshape(a, [9])], &
                        [m_end, reshape(quat_to_matrix(q_end), [9])], sensitivity*eps)
    end subroutine check_end

    !> Motions with a formula of their own.
    subroutine check_special_motions(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: m0(3) = [0.6_wp, 0.0_wp, 0.8_wp], moments(3) = [0.5_wp, 1.0_wp, 4.0_wp]
        real(wp), parameter :: h = 1.3_wp
        real(wp) :: m(3), q(4), a(3, 3), expected(4), errors(3), e(3)
        integer :: axis

        call quat_step(m, q, h, [2.0_wp, 2.0_wp, 2.0_wp], 3*m0, no_turn)
        call t%close_to('sphere-turns-by-time-times-momentum-over-moment', [m, q], &
                        [3*m0, cos(h*3/4), sin(h*3/4)*m0], 2*eps)
        do axis = 1, 3
            e = 0.0_wp
            e(axis) = -2.0_wp
            call quat_step(m, q, h, moments, e, no_turn)
            expected = 0.0_wp
            expected(1) = cos(h/moments(axis))      ! half the angle 2 h/I
            expected(1 + axis) = -sin(h/moments(axis))
            call frb_step(m, a, h, moments, e, no_rotation)
            errors(axis) = largest([abs(q - expected), abs(a - quat_to_matrix(expected)), abs(m - e)])
        end do
        call t%at_most('axis-rotation-turns-about-its-axis', largest(errors), 4*eps)

        call frb_step(m, a, h, [2.0_wp, 3.0_wp, 6.0_wp], sqrt(0.5_wp)*[1.0_wp, 0.0_wp, 1.0_wp], no_rotation)
        call t%close_to('separatrix-follows-tanh-and-sech', m, &
                        [sqrt(0.5_wp)/cosh(h/6), tanh(h/6), sqrt(0.5_wp)/cosh(h/6)], 2*eps)
        call frb_step(m, a, 1.0e5_wp, [2.0_wp, 3.0_wp, 6.0_wp], sqrt(0.5_wp)*[1.0_wp, 0.0_wp, 1.0_wp], &
                      no_rotation)
        call t%close_to('separatrix-ends-at-the-middle-axis', m, [0.0_wp, 1.0_wp, 0.0_wp], 2*eps)

        call quat_step(m, q, h, [1.0_wp, 1.0_wp, 2.0_wp], m0, no_turn)
        call t%close_to('two-equal-moments-precess-uniformly', m, &
                        [0.6_wp*cos(0.4_wp*h), 0.6_wp*sin(0.4_wp*h), 0.8_wp], 2*eps)
        call quat_step(m, q, h, [1.0_wp, 2.0_wp, 2.0_wp], m0, no_turn)
        call t%close_to('two-equal-larger-moments-precess-uniformly', m, &
                        [0.6_wp, 0.8_wp*sin(0.3_wp*h), 0.8_wp*cos(0.3_wp*h)], 2*eps)

        call quat_step(m, q, h, [1.0_wp, 2.0_wp, 3.0_wp], [0.0_wp, 0.0_wp, 0.0_wp], no_turn)
        call t%close_to('no-momentum-no-motion', [m, q], [0.0_wp, 0.0_wp, 0.0_wp, no_turn], 0.0_wp)
        call frb_step(m, a, 0.0_wp, [1.0_wp, 2.0_wp, 3.0_wp], [0.3_wp, 0.2_wp, 0.1_wp], no_rotation)
        call t%close_to('no-time-no-change-of-momentum', m, [0.3_wp, 0.2_wp, 0.1_wp], 0.0_wp)
        call t%close_to('no-time-no-turn', reshape(a, [9]), reshape(no_rotation, [9]), 4*eps)
    end subroutine check_special_motions

    !> Any finite input: a result, |m| kept, attitude orthogonal. Sizes over the whole range of numbers.
    subroutine check_extremes(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: sizes(8) = [1.0_wp, 0.0_wp, 1.0e-300_wp, 1.0e300_wp, 5.0e-324_wp, 0.7_wp, &
                                           1.0e-20_wp, -1.0e150_wp]
        real(wp), parameter :: bodies(3, 8) = reshape([ &
            2.0_wp, 3.0_wp, 6.0_wp, 1.0_wp, 1.0_wp, 2.0_wp, 1.0e300_wp, 1.0_wp, 1.0e-300_wp, &
            3.0e-308_wp, 2.5e-308_wp, 4.0e-308_wp, 1.0e308_wp, 1.7e308_wp, 1.5e308_wp, &
            1.0_wp, 1.0_wp - eps, 1.0_wp + eps, 1.0e-30_wp, 1.0_wp, 1.0_wp + eps, &
            1.0_wp, 1.1_wp, 1.0e100_wp], [3, 8])
        real(wp) :: h, m0(3), m(3), q(4), a(3, 3), defect, change
        integer :: body, i, j, k, l, frame, np
        logical :: finite

        finite = .true.
        defect = 0.0_wp
        change = 0.0_wp
        do body = 1, size(bodies, 2)
            do l = 0, 4095, 3     ! every third of the 8**4 combinations
                i = ibits(l, 0, 3) + 1
                j = ibits(l, 3, 3) + 1
                k = ibits(l, 6, 3) + 1
                m0 = [sizes(i), sizes(j), sizes(k)]
                h = sizes(ibits(l, 9, 3) + 1)
                frame = mod(l, 4)
                np = merge(2, 0, mod(l, 7) == 0)
                if (frame == 0) then
                    call frb_step(m, a, h, bodies(:, body), m0, no_rotation, np)
                    finite = finite .and. all(ieee_is_finite(a))
                    defect = worst_of(defect, [abs(matmul(transpose(a), a) - no_rotation)])
                else
                    call quat_step(m, q, h, bodies(:, body), m0, no_turn, np, frame)
                    finite = finite .and. all(ieee_is_finite(q))
                    defect = worst_of(defect, abs(sqrt(sum(q**2)) - 1))
                end if
                finite = finite .and. all(ieee_is_finite(m))
                change = worst_of(change, abs(norm3(m) - norm3(m0))/max(norm3(m0), 1.0e-308_wp))
            end do
        end do
        call t%ok('every-finite-input-gives-a-finite-result', finite)
        call t%at_most('extreme-steps-keep-the-attitude-orthogonal', defect, orthogonal)
        call t%at_most('extreme-steps-keep-the-norm-of-the-momentum', change, 16*eps)
    end subroutine check_extremes

    !> Input and output may be one variable.
    subroutine check_same_variable(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: moments(3) = [2.0_wp, 1.0_wp, 1.5_wp], m0(3) = [0.3_wp, -0.7_wp, 0.5_wp]
        real(wp), parameter :: q0(4) = [0.8_wp, -0.4_wp, 0.2_wp, 0.4_wp]
        real(wp) :: m(3), mm(3), q(4), qq(4), a(3, 3), aa(3, 3)
        integer :: np

        do np = 0, 2, 2
            call quat_step(m, q, 0.7_wp, moments, m0, q0, np)
            mm = m0
            qq = q0
            call quat_step(mm, qq, 0.7_wp, moments, mm, qq, np)
            call t%close_to('quaternion-step-in-place', [mm, qq], [m, q], 0.0_wp)
            call frb_step(m, a, 0.7_wp, moments, m0, quat_to_matrix(q0), np)
            mm = m0
            aa = quat_to_matrix(q0)
            call frb_step(mm, aa, 0.7_wp, moments, mm, aa, np)
            call t%close_to('matrix-step-in-place', [mm, reshape(aa, [9])], [m, reshape(a, [9])], 0.0_wp)
        end do
    end subroutine check_same_variable

    !> Each way an argument can be wrong: the code, and the input handed back.
    subroutine check_refusals(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: i0(3) = [1.0_wp, 2.0_wp, 3.0_wp], m0(3) = [0.3_wp, -0.7_wp, 0.5_wp]
        real(wp) :: bad(5), m(3), q(4), a(3, 3), wrong(3), wrong_q(4), wrong_a(3, 3)
        integer :: i, stat

        bad = [ieee_value(1.0_wp, ieee_quiet_nan), ieee_value(1.0_wp, ieee_positive_inf), 0.0_wp, -1.0_wp, &
               5.0e-324_wp]
        do i = 1, 5
            wrong = i0
            wrong(mod(i, 3) + 1) = bad(i)
            call frb_step(m, a, 1.0_wp, wrong, m0, no_rotation, stat=stat)
            call t%ok('matrix-step-refuses-bad-moment', stat == status_bad_moments &
                      .and. all(abs(m - m0) <= 0.0_wp) .and. all(abs(a - no_rotation) <= 0.0_wp))
            call quat_step(m, q, 1.0_wp, wrong, m0, no_turn, stat=stat)
            call t%ok('quaternion-step-refuses-bad-moment', stat == status_bad_moments &
                      .and. all(abs(m - m0) <= 0.0_wp) .and. all(abs(q - no_turn) <= 0.0_wp))
        end do
        do i = 1, 2
            wrong = m0
            wrong(2) = bad(i)
            call frb_step(m, a, 1.0_wp, i0, wrong, no_rotation, stat=stat)
            call t%equal('matrix-step-refuses-bad-momentum', stat, status_bad_momentum)
            call quat_step(m, q, 1.0_wp, i0, wrong, no_turn, stat=stat)
            call t%equal('quaternion-step-refuses-bad-momentum', stat, status_bad_momentum)
            call frb_step(m, a, bad(i), i0, m0, no_rotation, stat=stat)
            call t%equal('matrix-step-refuses-bad-time', stat, status_bad_time)
            call quat_step(m, q, bad(i), i0, m0, no_turn, stat=stat)
            call t%equal('quaternion-step-refuses-bad-time', stat, status_bad_time)
            wrong_a = no_rotation
            wrong_a(3, 1) = bad(i)
            call frb_step(m, a, 1.0_wp, i0, m0, wrong_a, stat=stat)
            call t%equal('matrix-step-refuses-bad-attitude', stat, status_bad_attitude)
            wrong_q = no_turn
            wrong_q(4) = bad(i)
            call quat_step(m, q, 1.0_wp, i0, m0, wrong_q, stat=stat)
            call t%equal('quaternion-step-refuses-bad-attitude', stat, status_bad_attitude)
        end do
        call quat_step(m, q, 1.0_wp, i0, m0, [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], stat=stat)
        call t%equal('quaternion-step-refuses-zero-quaternion', stat, status_bad_attitude)
        call quat_step(m, q, 1.0_wp, i0, m0, huge(1.0_wp)*no_turn, stat=stat)
        call t%equal('quaternion-step-refuses-absurd-quaternion', stat, status_bad_attitude)
        call frb_step(m, a, 1.0_wp, i0, m0, -huge(1.0_wp)*no_rotation, stat=stat)
        call t%equal('matrix-step-refuses-absurd-matrix', stat, status_bad_attitude)
        call frb_step(m, a, 1.0_wp, i0, m0, no_rotation, -1, stat)
        call t%equal('matrix-step-refuses-negative-number-of-points', stat, status_bad_count)
        call frb_step(m, a, 1.0_wp, i0, m0, no_rotation, huge(1), stat)
        call t%equal('matrix-step-refuses-absurd-number-of-points', stat, status_bad_count)
        call quat_step(m, q, 1.0_wp, i0, m0, no_turn, -1, stat=stat)
        call t%equal('quaternion-step-refuses-negative-number-of-points', stat, status_bad_count)
        call quat_step(m, q, 1.0_wp, i0, m0, no_turn, frame=0, stat=stat)
        call t%equal('quaternion-step-refuses-frame-0', stat, status_bad_option)
        call quat_step(m, q, 1.0_wp, i0, m0, no_turn, frame=4, stat=stat)
        call t%equal('quaternion-step-refuses-frame-4', stat, status_bad_option)
        call quat_step(m, q, 1.0_wp, i0, m0, no_turn, stat=stat)
        call t%equal('good-input-is-accepted', stat, status_ok)
        call t%ok('step-moves', any(abs(m - m0) > 1.0e-3_wp))
    end subroutine check_refusals

end module frb_test_steps
