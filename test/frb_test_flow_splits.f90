!> free_flow: results of a batch do not depend on how it is split.
module frb_test_flow_splits
    use frb_checks, only: tally
    use frb_flow_samples, only: stream, not_a_number, same_bits
    use frb_free_flow, only: free_flow, rigid_body
    use frb_kinds, only: wp
    use frb_rotations, only: quat_to_matrix
    implicit none
    private

    public :: test_flow_splits

    real(wp), parameter :: q0(4) = [0.5_wp, -0.5_wp, 0.1_wp, 0.7_wp]

contains

    subroutine test_flow_splits(t)
        type(tally), intent(inout) :: t

        call t%open_suite('flow-splits', 4)
        call check_splits(t)
        call t%close_suite()
    end subroutine test_flow_splits

    !> 4200 bodies of all sorts, short and long steps: the same bits in one call and in parts of any length,
    !> for equal and different bodies, with and without attitude.
    subroutine check_splits(t)
        type(tally), intent(inout) :: t
        integer, parameter :: n = 4200     ! from 4096 on threads share them, in a build with OpenMP
        type(stream) :: random
        type(rigid_body), allocatable :: bodies(:)
        real(wp), allocatable :: m(:, :), q(:, :), m1(:, :), q1(:, :)
        logical :: different, equal, alone
        integer :: i, k

        allocate (bodies(n), m(3, n), q(4, n))
        call draw_batch(random, bodies, m, q)
        different = .true.
        equal = .true.
        alone = .true.
        do k = -4, 3
            call compare_splits(bodies, 3*10.0_wp**k, m, q, different, alone)
            call compare_splits(bodies(:1), 3*10.0_wp**k, m, q, equal, alone)
        end do
        call t%ok('different-bodies-give-the-same-bits-however-split', different)
        call t%ok('equal-bodies-give-the-same-bits-however-split', equal)
        call t%ok('momenta-alone-give-the-same-bits', alone)
        ! Numbers about as small as a block accepts: every block must decide alike.
        do i = 1, n
            m(:, i) = random%log_uniform(-74.7_wp, -73.0_wp)*random%direction()
            q(:, i) = random%log_uniform(-74.7_wp, -73.0_wp)*q0
        end do
        allocate (m1, source=m)
        allocate (q1, source=q)
        call advance_in_parts(bodies(:1), n, 1.0e74_wp, m1, q1)
        call advance_in_parts(bodies(:1), 7, 1.0e74_wp, m, q)
        call t%ok('smallest-numbers-give-the-same-bits-however-split', &
                  same_bits([m], [m1]) .and. same_bits([q], [q1]))
    end subroutine check_splits

    !> Bodies and states of all sorts: extreme numbers, tensors, symmetric bodies; some that are refused.
    subroutine draw_batch(random, bodies, m, q)
        type(stream), intent(inout) :: random
        type(rigid_body), intent(out) :: bodies(:)
        real(wp), intent(out) :: m(:, :), q(:, :)
        real(wp) :: tensor(3, 3), r(3, 3), size_m, turn(4)
        integer :: i

        do i = 1, size(bodies)
            bodies(i) = rigid_body(random%triangle())
            size_m = 1.0_wp
            select case (mod(i, 11))
            case (1, 2)
                size_m = random%log_uniform(-6.0_wp, 6.0_wp)
            case (3)
                size_m = random%log_uniform(-300.0_wp, 300.0_wp)
            case (4)
                turn = [random%uniform(-1.0_wp, 1.0_wp), random%direction()]
                r = quat_to_matrix(turn/norm2(turn))
                tensor = matmul(r, transpose(spread(bodies(i)%moments(), 1, 3)*r))
                bodies(i) = rigid_body(0.5_wp*(tensor + transpose(tensor)))
            case (5)
                bodies(i) = rigid_body(random%log_uniform(-3.0_wp, 3.0_wp)*[1.0_wp, 1.0_wp, 0.5_wp])
            case default
            end select
            m(:, i) = size_m*random%direction()
            if (mod(i, 50) == 7) m(2, i) = not_a_number(i)
            if (mod(i, 50) == 8) m(:, i) = 0.0_wp
            q(:, i) = q0
            if (mod(i, 50) == 9) q(:, i) = 0.0_wp
        end do
    end subroutine draw_batch

    !> Advances by one call, by calls for parts of several lengths, and without attitude. `equal` and `alone`
    !> become false if parts, or momenta alone, give other bits.
    subroutine compare_splits(bodies, h, m, q, equal, alone)
        type(rigid_body), intent(in) :: bodies(:)       !! one for all states, or one for each state
        real(wp), intent(in) :: h, m(:, :), q(:, :)
        logical, intent(inout) :: equal, alone
        integer, parameter :: lengths(7) = [1, 3, 7, 24, 32, 37, 500]
        real(wp), allocatable :: m1(:, :), q1(:, :), m2(:, :), q2(:, :)
        integer :: i, stat

        allocate (m1, m2, source=m)
        allocate (q1, q2, source=q)
        call advance_in_parts(bodies, size(m, 2), h, m1, q1)
        if (size(bodies) == 1) then
            call free_flow(bodies(1), h, m2, stat)
        else
            call free_flow(bodies, h, m2, stat)
        end if
        do i = 1, size(m, 2)
            if (mod(i, 50) /= 9) alone = alone .and. same_bits(m2(:, i), m1(:, i))
        end do
        do i = 1, size(lengths)
            m2 = m
            q2 = q
            call advance_in_parts(bodies, lengths(i), h, m2, q2)
            equal = equal .and. same_bits([m2], [m1]) .and. same_bits([q2], [q1])
        end do
    end subroutine compare_splits

    !> Advances the states in calls for `length` states each; the last part may be shorter.
    subroutine advance_in_parts(bodies, length, h, m, q)
        type(rigid_body), intent(in) :: bodies(:)       !! one for all states, or one for each state
        integer, intent(in) :: length
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(:, :), q(:, :)
        integer :: n, first, last, stat

        n = size(m, 2)
        do first = 1, n, length
            last = min(first + length - 1, n)
            if (size(bodies) == 1) then
                call free_flow(bodies(1), h, m(:, first:last), q(:, first:last), stat)
            else
                call free_flow(bodies(first:last), h, m(:, first:last), q(:, first:last), stat)
            end if
        end do
    end subroutine advance_in_parts

end module frb_test_flow_splits
