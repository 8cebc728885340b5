!> The order of a splitting scheme, from its coefficients alone.
!>
!> One step is the product exp(c_1 X_1) exp(c_2 X_2) ... with each X either A (the drift) or B (the kick), and
!> is compared with exp(A + B) as a formal power series in two letters that do not commute: the coefficient of
!> a word of n letters in exp(A + B) is 1/n!. The scheme has order p if all words up to length p agree; for
!> the difference of the lowest degree this is the same as the conditions on Lyndon words, without choosing a
!> basis.
!>
!> A modified kick is exp(b B + c C) with C = [B,[A,B]] = 2 BAB - BBA - ABB, of three letters: for a body
!> m += b h tau + c h^3 g, see frb_modified_kicks.
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
    use frb_lapack, only: dposv
    use, intrinsic :: iso_fortran_env, only: int32
    implicit none
    private

    public :: order_report, order_conditions, longest_word

    !> Words up to this length are compared, so this is the highest order that can be found.
    integer, parameter :: longest_word = 10

    !> Order and residuals of a scheme. A residual is the Euclidean norm of the difference from exp(A + B)
    !> over a set of words.
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

    !> The order of the product of exp(drifts(1) A), exp(kicks(1) B + modified(1) C), exp(drifts(2) A) ...,
    !> or, unless `drift_first`, of exp(kicks(1) B + modified(1) C), exp(drifts(1) A) ...
    !> A condition counts as met when its residual is at most `tolerance`; the default is well above the
    !> rounding of coefficients given to 14 digits and well below the residual of any condition that is not
    !> met. Order 0 when numbers of coefficients do not match.
    pure function order_conditions(drifts, kicks, drift_first, tolerance, modified) result(report)
        real(wp), intent(in) :: drifts(:), kicks(:)     !! coefficients a and b in the order of use, finite
        logical, intent(in) :: drift_first              !! whether drifts(1) comes before kicks(1)
        real(wp), intent(in), optional :: tolerance     !! default 1e-12
        real(wp), intent(in), optional :: modified(:)   !! coefficients c, one a kick; default 0
        type(order_report) :: report
        real(wp) :: series(last_word), c(size(kicks)), met
        real(wp) :: full(longest_word, 0:longest_word)  ! squared residual, by length and number of kicks
        real(wp) :: reduced(longest_word, 0:longest_word)
        integer :: length, count, word, most, i, k

        if (abs(size(drifts) - size(kicks)) > 1) return
        met = 1.0e-12_wp
        if (present(tolerance)) met = tolerance
        c = 0.0_wp
        if (present(modified)) then
            if (size(modified) /= size(c)) return
            c = modified
        end if
        series = 0.0_wp
        series(1) = 1.0_wp
        do i = 1, max(size(drifts), size(kicks))
            if (drift_first .and. i <= size(drifts)) call append_flow(series, drifts(i), 0.0_wp, 0.0_wp)
            if (i <= size(kicks)) call append_flow(series, 0.0_wp, kicks(i), c(i))
            if (.not. drift_first .and. i <= size(drifts)) call append_flow(series, drifts(i), 0.0_wp, 0.0_wp)
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

    !> series <- series * exp(a A + b B + c C), by its terms series * (...)^n/n!.
    pure subroutine append_flow(series, a, b, c)
        real(wp), intent(inout) :: series(last_word)
        real(wp), intent(in) :: a, b, c
        real(wp) :: term(last_word)
        integer :: word, n

        term = series
        do n = 1, longest_word
            ! Downwards: each word takes from shorter ones, which still have their old values.
            do word = last_word, 1, -1
                term(word) = (merge(a, b, iand(word, 1) == 0)*at(word/2) + c*from_modified(word))/n
            end do
            series = series + term
        end do

    contains

        !> The term's coefficient of a word; 0 for a number that is no word.
        pure function at(shorter) result(value)
            integer, intent(in) :: shorter
            real(wp) :: value

            value = 0.0_wp
            if (shorter > 0) value = term(shorter)
        end function at

        !> The contribution of C = 2 BAB - BBA - ABB at the end of a word to its coefficient.
        pure function from_modified(longer) result(value)
            integer, intent(in) :: longer
            real(wp) :: value

            select case (iand(longer, 7))
            case (5)
                value = 2*at(longer/8)
            case (6, 3)
                value = -at(longer/8)
            case default
                value = 0.0_wp
            end select
        end function from_modified

    end subroutine append_flow

    !> Squared distance of the part of `series` with `length` letters, `count` of them B, from the ideal of
    !> r = [B,[B,[B,A]]] = BBBA - 3 BBAB + 3 BABB - ABBB.
    !>
    !> A basis of the ideal: u r v for every word u BBBA v, BBBA being the first of its kind in the word. As
    !> BBBA does not overlap with itself, these leading words tell the ideal (a Groebner basis of one).
    pure function outside_ideal(series, length, count) result(distance)
        real(wp), intent(in) :: series(last_word)
        integer, intent(in) :: length, count
        real(wp) :: distance
        integer, parameter :: letters(4) = [14, 13, 11, 7]      ! BBBA, BBAB, BABB, ABBB in binary
        real(wp), parameter :: relation(4) = [1.0_wp, -3.0_wp, 3.0_wp, -1.0_wp]
        real(wp) :: rest(2**length:2**(length + 1) - 1)
        real(wp), allocatable :: products(:, :), matrix(:, :), along(:)
        integer, allocatable :: words(:, :)                     ! of each element of the basis
        integer(int32) :: n, info
        integer :: rank, word, after, i, j, k, pass

        allocate (words(4, 2**length))
        rank = 0
        rest = 0.0_wp
        do word = 2**length, 2**(length + 1) - 1
            if (popcnt(word) - 1 /= count) cycle
            rest(word) = series(word)
            do after = length - 4, 0, -1                        ! letters right of r
                if (iand(ishft(word, -after), 15) /= letters(1)) cycle
                rank = rank + 1
                words(:, rank) = word + (letters - letters(1))*2**after
                exit
            end do
        end do
        allocate (products(rank, rank), matrix(rank, rank), along(rank))
        do j = 1, rank
            do i = 1, rank
                products(i, j) = 0.0_wp
                do k = 1, 4
                    products(i, j) = products(i, j) + relation(k)*sum(relation, words(:, i) == words(k, j))
                end do
            end do
        end do
        ! Twice, so that the difference is orthogonal to rounding.
        do pass = 1, 2
            do j = 1, rank
                along(j) = sum(relation*rest(words(:, j)))
            end do
            matrix = products
            n = int(rank, int32)
            if (n > 0) call dposv('L', n, 1_int32, matrix, n, along, n, info)
            do j = 1, rank
                rest(words(:, j)) = rest(words(:, j)) - along(j)*relation
            end do
        end do
        distance = sum(rest**2)
    end function outside_ideal

end module frb_order_conditions
