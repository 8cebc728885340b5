!> The order of a splitting scheme, from its coefficients alone.
!>
!> One step is the product exp(c_1 X_1) exp(c_2 X_2) ... with each X either A (the drift) or B (the kick), and
!> is compared with exp(A + B) as a formal power series in two letters that do not commute: the coefficient of
!> a word of n letters in exp(A + B) is 1/n!. The scheme has order p if all words up to length p agree; for
!> the difference of the lowest degree this is the same as the conditions on Lyndon words, without choosing a
!> basis.
!>
!> With the Nystroem condition [B,[B,[B,A]]] = 0 only the part of the difference outside the two-sided ideal
!> spanned by u (BBBA - 3 BBAB + 3 BABB - ABBB) v counts; it is found by orthogonal projection. The condition
!> holds for every body under a torque that depends on the attitude (and time) only, because T is quadratic in
!> m.
!>
!> Source: the free-algebra form of the order conditions in S. Blanes and P. C. Moan, J. Comput. Appl. Math.
!> 142 (2002) 313, section 2; near-integrable orders as in S. Blanes et al., Appl. Numer. Math. 68 (2013) 58.
module frb_order_conditions
    use frb_kinds, only: wp
    implicit none
    private

    public :: order_report, order_conditions, longest_word

    !> Words up to this length are compared, so this is the highest order that can be told.
    integer, parameter :: longest_word = 9

    !> What the order conditions say about a scheme. A residual is the Euclidean norm of the difference from
    !> exp(A + B) over a set of words.
    type :: order_report
        integer :: order = 0                !! for any A and B
        integer :: nystroem_order = 0       !! when [B,[B,[B,A]]] = 0
        integer :: kick_orders(3) = 0       !! p1 >= p2 >= p3: for a torque of size e one step errs by terms
                                            !! e h^(p1+1), e^2 h^(p2+1) and e^3 h^(p3+1), Nystroem assumed
        real(wp) :: residuals(longest_word) = 0.0_wp           !! words of length n, any A and B
        real(wp) :: nystroem_residuals(longest_word) = 0.0_wp  !! words of length n, Nystroem
    end type order_report

    !> Words are coded as integers: the empty word is 1, appending A doubles, appending B doubles and adds
    !> one.
    integer, parameter :: last_word = 2**(longest_word + 1) - 1

contains

    !> The order of the product of exp(drifts(1) A), exp(kicks(1) B), exp(drifts(2) A) ..., or, unless
    !> `drift_first`, of exp(kicks(1) B), exp(drifts(1) A) ...
    !> A condition counts as met when its residual is at most `tolerance`; the default stands well above the
    !> rounding of coefficients given to 14 digits and well below any condition missed.
    pure function order_conditions(drifts, kicks, drift_first, tolerance) result(report)
        real(wp), intent(in) :: drifts(:), kicks(:)     !! coefficients a and b in the order of use, finite
        logical, intent(in) :: drift_first              !! whether drifts(1) comes before kicks(1)
        real(wp), intent(in), optional :: tolerance     !! default 1e-12
        type(order_report) :: report
        real(wp) :: series(last_word), met
        real(wp) :: full(longest_word, 0:longest_word)  ! squared residual, by length and number of kicks
        real(wp) :: reduced(longest_word, 0:longest_word)
        integer :: length, count, word, most, i, k

        met = 1.0e-12_wp
        if (present(tolerance)) met = tolerance
        series = 0.0_wp
        series(1) = 1.0_wp
        do i = 1, max(size(drifts), size(kicks))
            if (drift_first .and. i <= size(drifts)) call append_flow(series, 0, drifts(i))
            if (i <= size(kicks)) call append_flow(series, 1, kicks(i))
            if (.not. drift_first .and. i <= size(drifts)) call append_flow(series, 0, drifts(i))
        end do

        full = 0.0_wp
        reduced = 0.0_wp
        do length = 1, longest_word
            do word = 2**length, 2**(length + 1) - 1
                series(word) = series(word) - 1/gamma(real(length + 1, wp))
                count = popcnt(word) - 1
                full(length, count) = full(length, count) + series(word)**2
            end do
            do count = 0, length
                if (count < 3 .or. count == length) then
                    reduced(length, count) = full(length, count)
                else
                    reduced(length, count) = outside_ideal(series, length, count)
                end if
            end do
        end do

        report%residuals = sqrt(sum(full, dim=2))
        report%nystroem_residuals = sqrt(sum(reduced, dim=2))
        report%order = leading(report%residuals <= met)
        report%nystroem_order = leading(report%nystroem_residuals <= met)
        do k = 1, 3
            most = merge(longest_word, k, k == 3)
            report%kick_orders(k) = leading(sqrt(sum(reduced(:, 1:most), dim=2)) <= met)
        end do
    end function order_conditions

    !> How many elements are true before the first that is not.
    pure function leading(met) result(count)
        logical, intent(in) :: met(:)
        integer :: count

        do count = 0, size(met) - 1
            if (.not. met(count + 1)) return
        end do
    end function leading

    !> series <- series * exp(c X) with X = A (letter 0) or B (letter 1).
    pure subroutine append_flow(series, letter, c)
        real(wp), intent(inout) :: series(last_word)
        integer, intent(in) :: letter
        real(wp), intent(in) :: c
        real(wp) :: factor
        integer :: word, stem, power

        ! Downwards: each word takes from shorter ones, which still have their old values.
        do word = last_word, 2, -1
            stem = word
            factor = 1.0_wp
            power = 0
            do while (stem > 1 .and. iand(stem, 1) == letter)
                stem = stem/2
                power = power + 1
                factor = factor*c/power
                series(word) = series(word) + factor*series(stem)
            end do
        end do
    end subroutine append_flow

    !> Squared distance of the part of `series` with `length` letters, `count` of them B, from the ideal of
    !> r = [B,[B,[B,A]]] = BBBA - 3 BBAB + 3 BABB - ABBB.
    pure function outside_ideal(series, length, count) result(distance)
        real(wp), intent(in) :: series(last_word)
        integer, intent(in) :: length, count
        real(wp) :: distance
        integer, parameter :: relation_letters(4) = [14, 13, 11, 7]   ! BBBA, BBAB, BABB, ABBB in binary
        real(wp), parameter :: relation(4) = [1.0_wp, -3.0_wp, 3.0_wp, -1.0_wp]
        real(wp), parameter :: dependent = 1.0e-10_wp   ! norms are 0 or not small
        real(wp), allocatable :: basis(:, :), v(:)
        real(wp) :: norm
        integer :: place(2**length:2**(length + 1) - 1)
        integer :: dimension, rank, word, left, right, after, i

        dimension = 0
        place = 0
        do word = 2**length, 2**(length + 1) - 1
            if (popcnt(word) - 1 /= count) cycle
            dimension = dimension + 1
            place(word) = dimension
        end do

        allocate (basis(dimension, dimension), v(dimension))
        rank = 0
        do after = 0, length - 4                               ! letters right of r
            do left = 2**(length - 4 - after), 2**(length - 3 - after) - 1
                do right = 0, 2**after - 1
                    if (popcnt(left) - 1 + popcnt(right) /= count - 3) cycle
                    v = 0.0_wp
                    do i = 1, 4
                        word = (left*16 + relation_letters(i))*2**after + right
                        v(place(word)) = v(place(word)) + relation(i)
                    end do
                    call remove_span(basis, rank, v)
                    norm = sqrt(sum(v**2))
                    if (norm <= dependent) cycle
                    rank = rank + 1
                    basis(:, rank) = v/norm
                end do
            end do
        end do

        do word = 2**length, 2**(length + 1) - 1
            if (place(word) > 0) v(place(word)) = series(word)
        end do
        call remove_span(basis, rank, v)
        distance = sum(v**2)
    end function outside_ideal

    !> Takes from v its part in the span of the first `rank` columns of an orthonormal basis; twice, so that
    !> what is left is orthogonal to rounding.
    pure subroutine remove_span(basis, rank, v)
        real(wp), intent(in) :: basis(:, :)
        integer, intent(in) :: rank
        real(wp), intent(inout) :: v(:)
        integer :: pass, i

        do pass = 1, 2
            do i = 1, rank
                v = v - dot_product(basis(:, i), v)*basis(:, i)
            end do
        end do
    end subroutine remove_span

end module frb_order_conditions
