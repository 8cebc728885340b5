!> flow_tangent against reference cases, in units of the inherent sensitivity of each derivative: one body
!> with and without its attitude, by its moments, bodies by a tensor.
module frb_test_tangent
    use frb_checks, only: tally, largest, worst_of
    use frb_claims, only: tangent_median, tangent_rods, tangent_largest
    use frb_flow_samples, only: no_turn, made_finite
    use frb_free_flow, only: flow_tangent, rigid_body
    use frb_kinds, only: wp
    use frb_reference_cases, only: reference_case, read_cases, score_momentum, score_attitude, median
    use frb_tangent_cases, only: tangent_case, read_tangent_cases, read_tensor_cases, score_matrix
    use, intrinsic :: ieee_exceptions, only: ieee_overflow, ieee_get_halting_mode, ieee_set_halting_mode
    implicit none
    private

    public :: test_tangent

    !> J, W, dm' and dtheta' by the inertia, J of the momentum alone.
    integer, parameter :: kinds = 5
    character(*), parameter :: names(kinds) = [character(12) :: 'J', 'W', 'm-by-I', 'theta-by-I', 'J-alone']

contains

    subroutine test_tangent(t)
        type(tally), intent(inout) :: t
        type(tangent_case), allocatable :: cases(:)

        call t%open_suite('tangent', 414)
        call read_tangent_cases('data/reference/tangent_cases.txt', cases)
        call check_groups(t, cases, '', 3, 13, .true.)
        call read_tangent_cases('data/reference/tangent_cases_seed500.txt', cases)
        call check_groups(t, cases, ' (seed 500)', 3, 13, .true.)
        call read_tangent_cases('data/reference/tangent_limits.txt', cases)
        call check_groups(t, cases, ' (limits)', 3, 11, .false.)
        call read_tensor_cases('data/reference/tangent_tensors.txt', cases)
        call check_groups(t, cases, ' (tensors)', 6, 8, .true.)
        call check_lanes(t, 'data/reference/tangent_cases.txt', '')
        call check_lanes(t, 'data/reference/tangent_cases_seed500.txt', ' (seed 500)')
        call check_state(t)
        call t%close_suite()
    end subroutine test_tangent

    !> Medians and largest scores of all groups of a file; the number of groups.
    subroutine check_groups(t, cases, label, columns, expected, medians)
        type(tally), intent(inout) :: t
        type(tangent_case), intent(in) :: cases(:)
        character(*), intent(in) :: label
        integer, intent(in) :: columns, expected
        logical, intent(in) :: medians      !! check medians too; scans of ten distances have too few cases
        real(wp) :: score(size(cases), kinds), bar
        logical :: here(size(cases))
        integer :: i, k, groups

        do i = 1, size(cases)
            call score_case(cases(i), columns, score(i, :))
        end do
        groups = 0
        do i = 1, size(cases)
            if (any(cases(:i - 1)%group == cases(i)%group)) cycle
            groups = groups + 1
            here = cases%group == cases(i)%group
            bar = merge(tangent_rods, tangent_median, any(cases(i)%group == [character(9) :: 'elongated', &
                                                                               'rod']))
            do k = 1, kinds
                associate (name => trim(names(k))//': '//trim(cases(i)%group)//label)
                    if (medians) call t%at_most('median-of-'//name, median(pack(score(:, k), here)), bar)
                    call t%at_most('score-of-'//name, largest(pack(score(:, k), here)), tangent_largest)
                end associate
            end do
        end do
        call t%equal('all-groups-are-there'//label, groups, expected)
    end subroutine check_groups

    !> Cases in lanes beside their neighbours of the file: their scores, their agreement with one body at a
    !> time, and that other neighbours do not change them.
    subroutine check_lanes(t, path, label)
        type(tally), intent(inout) :: t
        character(*), intent(in) :: path, label
        integer, parameter :: n = 70    ! whole blocks and six more bodies
        type(tangent_case), allocatable :: cases(:)
        real(wp) :: m(3, n), q(4, n), transition(6, 6, n), m_one(3), q_one(4), alone(6, 6), worst(2), apart, &
            moved
        real(wp), allocatable :: score(:, :)
        integer :: i, j, lane, k
        logical :: halting

        call read_tangent_cases(path, cases)
        allocate (score(size(cases), 2))
        ! A neighbour on the separatrix may go on for so long that its derivative overflows.
        call ieee_get_halting_mode(ieee_overflow, halting)
        call ieee_set_halting_mode(ieee_overflow, .false.)
        apart = 0.0_wp
        moved = 0.0_wp
        do i = 1, size(cases)
            do k = 1, 2
                lane = 1 + mod(7*i + 29*k, 64)     ! the last six bodies move one by one
                do j = 1, n
                    m(:, j) = cases(1 + modulo(i - 1 + k*(j - lane), size(cases)))%m0
                    q(:, j) = no_turn
                end do
                call flow_tangent(cases(i)%body, cases(i)%h, m, q, transition)
                if (k == 1) alone = transition(:, :, lane)
            end do
            if (norm2(alone) < 1.0e100_wp) moved = worst_of(moved, [abs(transition(:, :, lane) - alone)])
            score(i, 1) = score_matrix(transition(1:3, 1:3, lane), cases(i)%jacobian, cases(i)%sensitivity(1))
            score(i, 2) = score_matrix(transition(4:6, 1:3, lane), cases(i)%turns, cases(i)%sensitivity(2))
            if (abs(cases(i)%h) <= 0.0_wp) score(i, 2) = largest([abs(transition(4:6, 1:3, lane))])
            m_one = cases(i)%m0
            q_one = no_turn
            call flow_tangent(cases(i)%body, cases(i)%h, m_one, q_one, alone)
            apart = worst_of(apart, [norm2(transition(4:6, 4:6, lane) - alone(4:6, 4:6)), &
                                     norm2(q(:, lane) - q_one), abs(transition(1:3, 4:6, lane))])
        end do
        call ieee_set_halting_mode(ieee_overflow, halting)
        worst = [largest(score(:, 1)), largest(score(:, 2))]
        call t%at_most('median-of-J-in-lanes'//label, median(score(:, 1)), tangent_median)
        call t%at_most('median-of-W-in-lanes'//label, median(score(:, 2)), tangent_median)
        call t%at_most('score-of-J-in-lanes'//label, worst(1), tangent_largest)
        call t%at_most('score-of-W-in-lanes'//label, worst(2), tangent_largest)
        call t%at_most('E-and-attitude-in-lanes-are-those-of-one-body'//label, apart, 1.0e-9_wp)
        call t%at_most('neighbours-change-no-digit'//label, moved, 0.0_wp)
    end subroutine check_lanes

    !> The state against the reference cases of free_flow, with its bars.
    subroutine check_state(t)
        type(tally), intent(inout) :: t
        type(reference_case), allocatable :: cases(:)
        real(wp) :: m(3), q(4), m_alone(3), phi(6, 6), jacobian(3, 3), worst(3)
        integer :: i

        call read_cases('data/reference/cases.txt', cases)
        worst = 0.0_wp
        do i = 1, size(cases)
            m = cases(i)%m0
            q = no_turn
            m_alone = m
            call flow_tangent(rigid_body(cases(i)%moments), cases(i)%h, m, q, phi)
            call flow_tangent(rigid_body(cases(i)%moments), cases(i)%h, m_alone, jacobian)
            worst = worst_of(worst, [score_momentum(cases(i), made_finite(m)), &
                                     score_attitude(cases(i), made_finite(q)), &
                                     score_momentum(cases(i), made_finite(m_alone))])
        end do
        call t%at_most('momentum-as-free-flow', worst(1), 2.0_wp)
        call t%at_most('attitude-as-free-flow', worst(2), 2.0_wp)
        call t%at_most('momentum-alone-as-free-flow', worst(3), 2.0_wp)
    end subroutine check_state

    !> One case.
    subroutine score_case(it, columns, score)
        type(tangent_case), intent(in) :: it
        integer, intent(in) :: columns          !! 3: by the moments; 6: by the tensor
        real(wp), intent(out) :: score(:)
        real(wp) :: m(3), q(4), transition(6, 6), jacobian(3, 3), by_inertia(6, columns)

        m = it%m0
        q = no_turn
        call flow_tangent(it%body, it%h, m, q, transition, by_inertia)
        score(1) = score_matrix(transition(1:3, 1:3), it%jacobian, it%sensitivity(1))
        score(2) = score_matrix(transition(4:6, 1:3), it%turns, it%sensitivity(2))
        score(3) = score_matrix(by_inertia(1:3, :), it%by_inertia(1:3, :columns), it%sensitivity(3))
        score(4) = score_matrix(by_inertia(4:6, :), it%by_inertia(4:6, :columns), it%sensitivity(4))
        m = it%m0
        call flow_tangent(it%body, it%h, m, jacobian)
        score(5) = score_matrix(jacobian, it%jacobian, it%sensitivity(1))
        if (abs(it%h) > 0.0_wp) return
        ! No step: the exact derivatives by m and I are 0, those in the file are rounding of its many digits.
        if (all(abs(transition(4:6, 1:3)) <= 0.0_wp) .and. all(abs(by_inertia) <= 0.0_wp)) score(2:4) = 0.0_wp
    end subroutine score_case

end module frb_test_tangent
