!> Reads reference cases (data/reference) and scores results against them, in units of the inherent
!> sensitivity: 1 is the error caused by rounding the input to double precision.
module frb_reference_cases
    use frb_kinds, only: wp, qp, unit_roundoff
    use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
    implicit none
    private

    public :: reference_case, read_cases, score_momentum, score_attitude, median

    !> Kept to 25 digits where the compiler can: double precision would add half a unit to a score.
    type :: reference_case
        character(20) :: group = ''
        real(wp) :: moments(3) = 0.0_wp
        real(wp) :: m0(3) = 0.0_wp
        real(wp) :: h = 0.0_wp
        real(qp) :: m(3) = 0.0_qp        !! exact momentum at h
        real(qp) :: q(4) = 0.0_qp        !! exact attitude at h, from the identity
        real(wp) :: sens_m = 0.0_wp
        real(wp) :: sens_q = 0.0_wp
    end type reference_case

contains

    !> All cases of a file, in its order; stops when the file cannot be read.
    subroutine read_cases(path, cases)
        character(*), intent(in) :: path
        type(reference_case), allocatable, intent(out) :: cases(:)
        type(reference_case) :: item
        integer :: unit, io, count, pass

        do pass = 1, 2
            open (newunit=unit, file=path, status='old', action='read')
            count = 0
            do
                read (unit, *, iostat=io) item%group, item%moments, item%m0, item%h, item%m, item%q, &
                    item%sens_m, item%sens_q
                if (io /= 0) exit
                count = count + 1
                if (pass == 2) cases(count) = item
            end do
            close (unit)
            if (pass == 1) allocate (cases(count))
        end do
    end subroutine read_cases

    !> |m - m_ref| in units of 2^-53 |m| + sens_m.
    pure function score_momentum(item, m) result(score)
        type(reference_case), intent(in) :: item
        real(wp), intent(in) :: m(3)
        real(wp) :: score

        score = real(sqrt(sum((m - item%m)**2))/(unit_roundoff*sqrt(sum(item%m**2)) + item%sens_m), wp)
    end function score_momentum

    !> Distance of the attitude from the reference, either sign, in units of 2 * 2^-53 + sens_q.
    pure function score_attitude(item, q) result(score)
        type(reference_case), intent(in) :: item
        real(wp), intent(in) :: q(4)
        real(wp) :: score

        score = real(2*sqrt(min(sum((q - item%q)**2), sum((q + item%q)**2))) &
                     /(2*unit_roundoff + item%sens_q), wp)
    end function score_attitude

    !> Median of the values (the upper of the two middle ones for an even count); NaN counts as huge.
    pure function median(values) result(middle)
        real(wp), intent(in) :: values(:)
        real(wp) :: middle
        real(wp) :: sorted(size(values)), key
        integer :: i, j

        sorted = merge(huge(1.0_wp), values, ieee_is_nan(values))
        do i = 2, size(sorted)
            key = sorted(i)
            j = i - 1
            do while (j >= 1)
                if (sorted(j) <= key) exit
                sorted(j + 1) = sorted(j)
                j = j - 1
            end do
            sorted(j + 1) = key
        end do
        middle = sorted(size(sorted)/2 + 1)
    end function median

end module frb_reference_cases
