!> free_flow: refused input leaves the state untouched, in batches the state of the refused bodies only.
module frb_test_flow_batches
    use frb_checks, only: tally, largest
    use frb_flow_samples, only: stream, advanced, made_finite, not_a_number, same_bits, no_rotation
    use frb_free_flow, only: free_flow, rigid_body
    use frb_kinds, only: wp
    use frb_status, only: status_ok, status_bad_moments, status_bad_tensor, status_bad_momentum, &
        status_bad_attitude, status_bad_time, status_bad_count
    implicit none
    private

    public :: test_flow_batches

    real(wp), parameter :: eps = epsilon(1.0_wp)
    real(wp), parameter :: moments(3) = [0.4_wp, 1.0_wp, 0.7_wp]
    real(wp), parameter :: m0(3) = [0.3_wp, -0.9_wp, 0.5_wp], q0(4) = [0.5_wp, -0.5_wp, 0.1_wp, 0.7_wp]

contains

    subroutine test_flow_batches(t)
        type(tally), intent(inout) :: t

        call t%open_suite('flow-batches', 25)
        call check_refused(t)
        call check_refused_in_batches(t)
        call check_counts(t)
        call t%close_suite()
    end subroutine test_flow_batches

    !> Each status, principal body and tensor body, momentum alone, quaternion, matrix.
    subroutine check_refused(t)
        type(tally), intent(inout) :: t
        type(rigid_body) :: good(2), bad(3)
        real(wp) :: tensor(3, 3), zero(4), bad_m(3), bad_q(4), bad_a(3, 3)
        logical :: right(7)
        integer :: i, j, k

        tensor = 0.1_wp
        do i = 1, 3
            tensor(i, i) = moments(i)
        end do
        good = [rigid_body(moments), rigid_body(tensor)]
        bad(1) = rigid_body([1.0_wp, -1.0_wp, 1.0_wp])
        tensor(1, 2) = 0.2_wp
        bad(2) = rigid_body(tensor)
        right = .true.
        right(1) = bad(1)%status() == status_bad_moments .and. bad(3)%status() == status_bad_moments &
            .and. bad(2)%status() == status_bad_tensor .and. all(good%status() == status_ok)
        do i = 1, 3
            if (.not. refused(bad(i), 1.0_wp, m0, q0, no_rotation, bad(i)%status(), &
                              .true., .true.)) right(2) = .false.
        end do
        zero = 0.0_wp
        zero(3) = -zero(3)
        do k = 1, 2
            do i = 1, 3
                if (.not. refused(good(k), not_a_number(i), m0, q0, no_rotation, &
                                  status_bad_time, .true., .true.)) right(3) = .false.
                do j = 1, 3
                    bad_m = m0
                    bad_m(j) = not_a_number(i)
                    if (.not. refused(good(k), 1.0_wp, bad_m, q0, no_rotation, &
                                      status_bad_momentum, .true., .true.)) right(4) = .false.
                end do
                do j = 1, 4
                    bad_q = q0
                    bad_q(j) = not_a_number(i)
                    if (.not. refused(good(k), 1.0_wp, m0, bad_q, no_rotation, &
                                      status_bad_attitude, .false., .true.)) right(5) = .false.
                end do
                do j = 1, 9
                    bad_a = no_rotation
                    bad_a(1 + mod(j, 3), 1 + mod((j - mod(j, 3))/3, 3)) = not_a_number(i)
                    if (.not. refused(good(k), 1.0_wp, m0, q0, bad_a, status_bad_attitude, &
                                      .false., .false.)) right(6) = .false.
                end do
            end do
            if (.not. refused(good(k), 1.0_wp, m0, zero, no_rotation, status_bad_attitude, &
                              .false., .true.)) right(7) = .false.
        end do
        call t%ok('bodies-that-could-not-be-made-say-why', right(1))
        call t%ok('such-bodies-are-refused-with-their-status', right(2))
        call t%ok('times-that-are-not-finite-are-refused', right(3))
        call t%ok('momenta-that-are-not-finite-are-refused', right(4))
        call t%ok('quaternions-that-are-not-finite-are-refused', right(5))
        call t%ok('matrices-that-are-not-finite-are-refused', right(6))
        call t%ok('quaternions-of-norm-zero-are-refused', right(7))
        ! Bad input is refused with no momentum and with no time, too.
        call t%ok('no-momentum-does-not-hide-a-bad-attitude', &
                  refused(good(1), 1.0_wp, [0.0_wp, 0.0_wp, 0.0_wp], zero, no_rotation, status_bad_attitude, &
                          .false., .true.))
        call t%ok('no-time-does-not-hide-a-bad-momentum', &
                  refused(good(1), 0.0_wp, [not_a_number(0), 0.0_wp, 0.0_wp], q0, no_rotation, &
                          status_bad_momentum, .true., .true.))
    end subroutine check_refused

    !> Whether calls with this input are refused with this status and leave it unchanged: the call with the
    !> quaternion or with the matrix and, if `alone`, the call with the momentum only.
    function refused(body, h, m_in, q_in, a_in, status, alone, by_quaternion) result(right)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h, m_in(3), q_in(4), a_in(3, 3)
        integer, intent(in) :: status
        logical, intent(in) :: alone, by_quaternion
        logical :: right
        real(wp) :: m(3), q(4), a(3, 3)
        integer :: stat

        right = .true.
        if (alone) then
            m = m_in
            call free_flow(body, h, m, stat)
            right = right .and. stat == status .and. same_bits(m, m_in)
        end if
        if (by_quaternion) then
            m = m_in
            q = q_in
            call free_flow(body, h, m, q, stat)
            right = right .and. stat == status .and. same_bits(m, m_in) .and. same_bits(q, q_in)
        end if
        if (alone .or. .not. by_quaternion) then
            m = m_in
            a = a_in
            call free_flow(body, h, m, a, stat)
            right = right .and. stat == status .and. same_bits(m, m_in) .and. same_bits([a], [a_in])
        end if
    end function refused

    !> Some bad bodies, momenta and attitudes among 100: their states stay, the others move as if alone.
    subroutine check_refused_in_batches(t)
        type(tally), intent(inout) :: t
        integer, parameter :: n = 100
        type(stream) :: random
        type(rigid_body) :: bodies(n)
        real(wp) :: m_in(3, n), q_in(4, n), m(3, n), q(4, n), alone(7), h
        logical :: bad(n), stays, goes_on
        integer :: i, form, stat, expected

        do form = 1, 6
            expected = status_bad_attitude
            do i = 1, n
                bodies(i) = rigid_body(random%triangle())
                if (form >= 4) bodies(i) = rigid_body(moments)
                m_in(:, i) = random%direction()
                q_in(:, i) = q0
                bad(i) = mod(i*i, 13) == 4
                if (.not. bad(i)) cycle
                select case (form)
                case (1)
                    bodies(i) = rigid_body([1.0_wp, 0.0_wp, 2.0_wp])
                    expected = status_bad_moments
                case (2, 4)
                    m_in(1 + mod(i, 3), i) = not_a_number(i)
                    expected = status_bad_momentum
                case (3, 5)
                    q_in(1 + mod(i, 4), i) = not_a_number(i)
                case default
                    q_in(:, i) = 0.0_wp
                end select
            end do
            stays = .true.
            goes_on = .true.
            do i = -2, 2
                h = 10.0_wp**i
                m = m_in
                q = q_in
                if (form <= 3) then
                    call free_flow(bodies, h, m, q, stat)
                else
                    call free_flow(bodies(1), h, m, q, stat)
                end if
                stays = stays .and. stat == expected
                call compare()
            end do
            call t%ok('bad-bodies-of-a-batch-stay-as-they-are: '//achar(48 + form), stays)
            call t%ok('good-bodies-of-a-batch-go-on: '//achar(48 + form), goes_on)
        end do
        m = m_in
        q = spread(q0, 2, n)
        call free_flow(bodies, not_a_number(1), m, q, stat)
        call t%ok('a-batch-refuses-a-time-that-is-not-finite', stat == status_bad_time &
                  .and. same_bits([m], [m_in]) .and. same_bits([q], [spread(q0, 2, n)]))
        call free_flow(rigid_body([1.0_wp, 2.0_wp, 0.0_wp]), 1.0_wp, m, stat)
        call t%ok('a-batch-refuses-its-only-body', stat == status_bad_moments .and. same_bits([m], [m_in]))

    contains

        subroutine compare()
            integer :: j

            do j = 1, n
                if (bad(j)) then
                    stays = stays .and. same_bits(m(:, j), m_in(:, j)) .and. same_bits(q(:, j), q_in(:, j))
                else
                    alone = advanced(bodies(j)%moments(), m_in(:, j), h, q_in(:, j))
                    ! The angle turned is of size h.
                    goes_on = goes_on .and. &
                        largest(abs(made_finite([m(:, j), q(:, j)]) - alone)) <= 16*eps*(1 + h)
                end if
            end do
        end subroutine compare

    end subroutine check_refused_in_batches

    !> Arrays that do not match.
    subroutine check_counts(t)
        type(tally), intent(inout) :: t
        type(rigid_body) :: body, bodies(4)
        real(wp) :: m(3, 5), q(4, 5), m_kept(3, 5), q_kept(4, 5), m4(4, 5), q3(3, 5)
        integer :: stat(7)

        body = rigid_body(moments)
        bodies = body
        m = spread(m0, 2, 5)
        q = spread(q0, 2, 5)
        m_kept = m
        q_kept = q
        m4 = 1.0_wp
        q3 = 1.0_wp
        call free_flow(bodies, 1.0_wp, m, stat(1))
        call free_flow(bodies, 1.0_wp, m, q, stat(2))
        call free_flow(body, 1.0_wp, m4, stat(3))
        call free_flow(body, 1.0_wp, m4, q, stat(4))
        call free_flow(body, 1.0_wp, m, q3, stat(5))
        call free_flow(body, 1.0_wp, m(:, :4), q, stat(6))
        call free_flow(bodies, 1.0_wp, m(:, :4), q, stat(7))
        call t%ok('arrays-that-do-not-match-are-refused', all(stat == status_bad_count))
        call t%ok('arrays-that-do-not-match-are-left-alone', same_bits([m, q], [m_kept, q_kept]))
    end subroutine check_counts

end module frb_test_flow_batches
