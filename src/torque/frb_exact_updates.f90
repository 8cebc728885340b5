!> Updates of a compensated run: the state is the unevaluated sum x + rest, |rest| <= about half a unit of the
!> last digit of x.
!>
!> Leading products are exact: a number is cut in two parts, x = a + b, where a has 26 bits at most and is a
!> multiple of a unit common to all numbers of its kind. Products of such parts and sums of these products fit
!> in 53 bits, with and without fused multiply-adds; all rounded terms are smaller by 2^-24.
module frb_exact_updates
    use frb_inertia, only: body_core
    use frb_kinds, only: wp
    implicit none
    private

    public :: turn_state, kick_state

    real(wp), parameter :: shift = 2.0_wp**28       ! (x + shift*size) - shift*size: 24 bits of size are left
    real(wp), parameter :: largest = 1.0e290_wp     ! shift times that does not overflow
    ! Momenta whose squares and products are far from overflow and underflow: |m| and the energy are kept.
    real(wp), parameter :: smallest_kept = 1.0e-60_wp, largest_kept = 1.0e60_wp

contains

    !> m + h tau, with h tau to the last digit of m_rest.
    pure subroutine kick_state(h, tau, m, m_rest)
        real(wp), intent(in) :: h, tau(3)
        real(wp), intent(inout) :: m(3), m_rest(3)
        real(wp) :: cut, h_a, h_b
        integer :: i

        cut = shift*min(abs(h), largest)
        h_a = (h + cut) - cut
        h_b = h - h_a
        cut = shift*min(max(abs(tau(1)), abs(tau(2)), abs(tau(3))), largest)
        do i = 1, 3
            call kick_one(h, h_a, h_b, tau(i), (tau(i) + cut) - cut, m(i), m_rest(i))
        end do
    end subroutine kick_state

    !> One component. The new m does not depend on the parts of tau or on m_rest, so the drift can begin
    !> early.
    pure subroutine kick_one(h, h_a, h_b, tau, tau_a, m, m_rest)
        real(wp), intent(in) :: h, h_a, h_b, tau, tau_a
        real(wp), intent(inout) :: m, m_rest
        real(wp) :: new, change

        new = m + h*tau
        change = new - m
        m_rest = (m - (new - change)) + ((h_a*tau_a - change) + ((h_a*(tau - tau_a) + h_b*tau) + m_rest))
        m = new
    end subroutine kick_one

    !> The state after a free motion that turns the body by the unit quaternion r: q(h) = q r, and m(h) =
    !> E(r)^T m, as m is constant in space. The increments are as accurate as r - 1, whose scalar part follows
    !> from the norm; |q|, |m| and the energy are kept far better: see the procedures below.
    pure subroutine turn_state(body, r, m, m_rest, q, q_rest)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: r(4)
        real(wp), intent(inout) :: m(3), m_rest(3), q(4), q_rest(4)
        real(wp), parameter :: far = 1.0e-3_wp      ! shorter turns round off 1e-19 of |q|, and save 8 %
        real(wp) :: w, rr, c1, c2, c3, m1, m2, m3, cut
        real(wp) :: change(3), turn_change(4), high(6), low(6)
        integer :: i, j, k

        rr = r(2)*r(2) + r(3)*r(3) + r(4)*r(4)
        w = r(1) - 1
        if (r(1) > 0.0_wp) w = -rr/(1 + r(1))
        turn_change = q_rest + increment(q, w, r)
        if (rr > far) then
            ! q_rest turns too, or it would come back in the norm.
            turn_change = turn_change + increment(q_rest, w, r)
            call keep_norm_of_attitude(turn_change, q, q_rest)
        else
            do i = 1, 4
                call add(q(i), q_rest(i), turn_change(i))
            end do
        end if
        m1 = m(1)
        m2 = m(2)
        m3 = m(3)
        ! With c = 2 r x m the increment of m is r x c - r1 c.
        c1 = 2*(r(3)*m3 - r(4)*m2)
        c2 = 2*(r(4)*m1 - r(2)*m3)
        c3 = 2*(r(2)*m2 - r(3)*m1)
        change(1) = m_rest(1) + ((r(3)*c3 - r(4)*c2) - r(1)*c1)
        change(2) = m_rest(2) + ((r(4)*c1 - r(2)*c3) - r(1)*c2)
        change(3) = m_rest(3) + ((r(2)*c2 - r(3)*c1) - r(1)*c3)
        cut = max(abs(m1), abs(m2), abs(m3))
        if (.not. (cut > smallest_kept .and. cut < largest_kept)) then
            call add(m(1), m_rest(1), change(1))
            call add(m(2), m_rest(2), change(2))
            call add(m(3), m_rest(3), change(3))
            return
        end if
        cut = shift*(abs(m1) + abs(m2) + abs(m3))
        call square_change(m1, m_rest(1), change(1), cut, high(1), low(1))
        call square_change(m2, m_rest(2), change(2), cut, high(2), low(2))
        call square_change(m3, m_rest(3), change(3), cut, high(3), low(3))
        if (body%needs_rotation) then
            do k = 1, 3
                i = 1 + mod(k, 3)
                j = 1 + mod(i, 3)
                call product_change(m(i), m_rest(i), change(i), m(j), m_rest(j), change(j), cut, &
                                    high(3 + k), low(3 + k))
            end do
        end if
        call add(m(1), m_rest(1), change(1))
        call add(m(2), m_rest(2), change(2))
        call add(m(3), m_rest(3), change(3))
        call keep_norm_and_energy(body, rr, high, low, m, m_rest, q, q_rest)
        ! m_rest back to half a unit: the next drift turns m alone, and the error of this grows with m_rest.
        change = m_rest
        call add(m(1), m_rest(1), change(1))
        call add(m(2), m_rest(2), change(2))
        call add(m(3), m_rest(3), change(3))
    end subroutine turn_state

    !> The change q (r - 1) of q by the turn r, w = r(1) - 1.
    pure function increment(q, w, r) result(change)
        real(wp), intent(in) :: q(4), w, r(4)
        real(wp) :: change(4)

        change(1) = q(1)*w - q(2)*r(2) - q(3)*r(3) - q(4)*r(4)
        change(2) = q(1)*r(2) + q(2)*w + q(3)*r(4) - q(4)*r(3)
        change(3) = q(1)*r(3) + q(3)*w + q(4)*r(2) - q(2)*r(4)
        change(4) = q(1)*r(4) + q(4)*w + q(2)*r(3) - q(3)*r(2)
    end function increment

    !> q + change, and |q| as before: rounding errors of the change are removed along q. Long equal turns
    !> would change |q| by up to half an epsilon a step, always in one direction.
    pure subroutine keep_norm_of_attitude(change, q, q_rest)
        real(wp), intent(in) :: change(4)
        real(wp), intent(inout) :: q(4), q_rest(4)
        real(wp) :: cut, stretch, high(4), low(4)
        integer :: i

        cut = shift*(abs(q(1)) + abs(q(2)) + abs(q(3)) + abs(q(4)))
        do i = 1, 4
            call square_change(q(i), q_rest(i), change(i), cut, high(i), low(i))
            call add(q(i), q_rest(i), change(i))
        end do
        stretch = -0.5_wp*((high(1) + high(2) + high(3) + high(4)) + (low(1) + low(2) + low(3) + low(4)))
        do i = 1, 4
            q_rest(i) = q_rest(i) + stretch*q(i)
        end do
    end subroutine keep_norm_of_attitude

    !> (m + change)^2 - (m + rest)^2 = high + low, high exact.
    pure subroutine square_change(m, rest, change, cut, high, low)
        real(wp), intent(in) :: m, rest, change, cut
        real(wp), intent(out) :: high, low
        real(wp) :: a, b, d, e, s, t

        a = (m + cut) - cut
        b = (m - a) + rest
        d = (change + cut) - cut
        e = (change - d) - rest
        s = 2*a + d
        t = 2*b + e
        high = d*s
        low = d*t + e*(s + t)
    end subroutine square_change

    !> (m + change)(n + change_n) - (m + rest)(n + rest_n) = high + low, high exact.
    pure subroutine product_change(m, rest, change, n, rest_n, change_n, cut, high, low)
        real(wp), intent(in) :: m, rest, change, n, rest_n, change_n, cut
        real(wp), intent(out) :: high, low
        real(wp) :: a, b, d, e, a_n, b_n, d_n, e_n

        a = (m + cut) - cut
        b = (m - a) + rest
        d = (change + cut) - cut
        e = (change - d) - rest
        a_n = (n + cut) - cut
        b_n = (n - a_n) + rest_n
        d_n = (change_n + cut) - cut
        e_n = (change_n - d_n) - rest_n
        high = d*a_n + d_n*(a + d)
        low = (e_n*(a + d) + e*(a_n + d_n + e_n)) + (b*(d_n + e_n) + b_n*(d + e))
    end subroutine product_change

    !> Removes rounding errors of |m|, by a change along m, and of the kinetic energy, by a turn v of m and q
    !> of a few units of the last digit of the drift's turn. rr is the square of the vector part of this turn;
    !> high + low are the changes of the squares of m, and of m2 m3, m3 m1, m1 m2 for a body by a tensor. If a
    !> drift does not keep the energy to rounding, nothing is removed from the energy.
    !>
    !> The motion magnifies these two errors in proportion to the time, and under a weak torque no others.
    !> 2 T is m . K m plus a multiple of |m|^2, in sorted axes beta m1^2 + alpha m2^2; k is K m x m.
    pure subroutine keep_norm_and_energy(body, rr, high, low, m, m_rest, q, q_rest)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: rr, high(6), low(6), m(3), q(4)
        real(wp), intent(inout) :: m_rest(3), q_rest(4)
        real(wp), parameter :: limit = (32*epsilon(1.0_wp))**2
        real(wp) :: stretch, half, defect, kk, v1, v2, v3, k(3)

        half = -0.5_wp/(m(1)*m(1) + m(2)*m(2) + m(3)*m(3))
        stretch = half*((high(1) + high(2) + high(3)) + (low(1) + low(2) + low(3)))
        m_rest(1) = m_rest(1) + stretch*m(1)
        m_rest(2) = m_rest(2) + stretch*m(2)
        m_rest(3) = m_rest(3) + stretch*m(3)
        if (body%beta < 1.0e-20_wp .or. body%beta > 1.0e20_wp) return
        if (body%needs_rotation) then
            call turned_defect(body, stretch, high, low, m, defect, k)
        else
            call sorted_defect(body, stretch, high(1:3), low(1:3), m, defect, k)
        end if
        kk = k(1)*k(1) + k(2)*k(2) + k(3)*k(3)
        if (.not. defect*defect < limit*rr*kk) return
        defect = (-0.25_wp/kk)*defect
        v1 = defect*k(1)
        v2 = defect*k(2)
        v3 = defect*k(3)
        m_rest(1) = m_rest(1) - 2*(v2*m(3) - v3*m(2))
        m_rest(2) = m_rest(2) - 2*(v3*m(1) - v1*m(3))
        m_rest(3) = m_rest(3) - 2*(v1*m(2) - v2*m(1))
        q_rest(1) = q_rest(1) - (q(2)*v1 + q(3)*v2 + q(4)*v3)
        q_rest(2) = q_rest(2) + (q(1)*v1 + q(3)*v3 - q(4)*v2)
        q_rest(3) = q_rest(3) + (q(1)*v2 + q(4)*v1 - q(2)*v3)
        q_rest(4) = q_rest(4) + (q(1)*v3 + q(2)*v2 - q(3)*v1)
    end subroutine keep_norm_and_energy

    !> The change of m . K m, after |m| is corrected by `stretch`, and k, in principal axes.
    pure subroutine sorted_defect(body, stretch, high, low, m, defect, k)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: stretch, high(3), low(3), m(3)
        real(wp), intent(out) :: defect, k(3)
        real(wp) :: alpha, beta, c, part1, part2, m1, m2, m3
        integer :: i1, i2, i3

        call sort_momentum(body, m, i1, i2, i3, m1, m2, m3)
        k(i1) = body%alpha*(m2*m3)
        k(i2) = -body%beta*(m3*m1)
        k(i3) = body%parity*(body%gamma*(m1*m2))
        c = shift*body%beta
        beta = (body%beta + c) - c
        alpha = (body%alpha + c) - c
        c = shift*max(abs(high(i1)), abs(high(i2)))
        part1 = (high(i1) + c) - c
        part2 = (high(i2) + c) - c
        defect = (beta*part1 + alpha*part2) &
                 + (body%beta*((high(i1) - part1) + low(i1)) + body%alpha*((high(i2) - part2) + low(i2))) &
                 + (((body%beta - beta)*part1 + (body%alpha - alpha)*part2) &
                    + (2*stretch)*(body%beta*(m1*m1) + body%alpha*(m2*m2)))
    end subroutine sorted_defect

    include '../flow/sorted_momentum.inc'

    !> The same for a body given by a tensor, in its axes: K has six elements, and products of m are needed.
    pure subroutine turned_defect(body, stretch, high, low, m, defect, k)
        type(body_core), intent(in) :: body
        real(wp), intent(in) :: stretch, high(6), low(6), m(3)
        real(wp), intent(out) :: defect, k(3)
        real(wp) :: form(3, 3), all_of_it(6), main(6), part(6), c, u(3), v(3), n(3)

        u = body%axes_high(:, body%order(1)) + body%axes_low(:, body%order(1))
        v = body%axes_high(:, body%order(2)) + body%axes_low(:, body%order(2))
        form = body%beta*spread(u, 1, 3)*spread(u, 2, 3) + body%alpha*spread(v, 1, 3)*spread(v, 2, 3)
        n = matmul(form, m)
        k = [n(2)*m(3) - n(3)*m(2), n(3)*m(1) - n(1)*m(3), n(1)*m(2) - n(2)*m(1)]
        all_of_it = [form(1, 1), form(2, 2), form(3, 3), 2*form(2, 3), 2*form(3, 1), 2*form(1, 2)]
        c = shift*body%beta
        main = (all_of_it + c) - c
        c = shift*maxval(abs(high))
        part = (high + c) - c
        defect = sum(main*part) + (sum(all_of_it*((high - part) + low)) + (sum((all_of_it - main)*part) &
                                                                           + (2*stretch)*dot_product(n, m)))
    end subroutine turned_defect

    !> x + change; rest receives the rounding error of the sum (Knuth).
    pure subroutine add(x, rest, change)
        real(wp), intent(inout) :: x
        real(wp), intent(out) :: rest
        real(wp), intent(in) :: change
        real(wp) :: total, part

        total = x + change
        part = total - x
        rest = (x - (total - part)) + (change - part)
        x = total
    end subroutine add

end module frb_exact_updates
