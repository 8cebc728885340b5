!> A small check module: named checks, counted, each failure printed with got, expected, error, tolerance.
!>
!> A suite opens with the number of checks it is going to make; a different count at its end is a failure,
!> so a test that silently does not run makes the suite fail. Checks that cannot run on this system count as
!> skipped, and their names are printed.
!>
!> In a brief run, for builds that are slow by their checks, long runs take a tenth of the steps that
!> they have in their names.
module frb_checks
    use, intrinsic :: iso_fortran_env, only: output_unit
    use frb_kinds, only: wp
    use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
    implicit none
    private

    public :: tally, largest, worst_of

    !> The larger of the score so far and one or several new scores. NaN counts as huge: max and maxval may
    !> ignore NaN.
    interface worst_of
        module procedure worst_of_two, worst_of_many
    end interface worst_of

    type :: tally
        integer :: passed = 0
        integer :: failed = 0
        integer :: skipped = 0
        logical :: brief = .false.
        integer, private :: announced = 0
        integer, private :: at_opening = 0
        character(:), allocatable, private :: suite
    contains
        procedure :: open_suite
        procedure :: close_suite
        procedure :: provided
        procedure :: many
        procedure :: ok
        procedure, private :: close_scalar
        procedure, private :: close_vector
        generic :: close_to => close_scalar, close_vector
        procedure :: at_most
        procedure :: equal
    end type tally

contains

    !> Starts a suite that is to make `checks` checks.
    subroutine open_suite(self, name, checks)
        class(tally), intent(inout) :: self
        character(*), intent(in) :: name
        integer, intent(in) :: checks

        self%suite = name
        self%announced = checks
        self%at_opening = self%passed + self%failed + self%skipped
        write (output_unit, '(a,i0,a)') 'suite '//name//' (', checks, ')'
        ! If the suite stops, its name is the last line written.
        flush (output_unit)
    end subroutine open_suite

    !> Ends a suite; fails if it made another number of checks than announced.
    subroutine close_suite(self)
        class(tally), intent(inout) :: self
        integer :: made

        made = self%passed + self%failed + self%skipped - self%at_opening
        if (made /= self%announced) then
            self%failed = self%failed + 1
            write (output_unit, '(a,i0,a,i0)') '  FAILED '//self%suite//': made ', made, &
                ' checks, announced ', self%announced
        end if
        flush (output_unit)
    end subroutine close_suite

    !> Whether `checks` checks can be made that need some condition; if not, they count as skipped.
    function provided(self, there, checks, name) result(can)
        class(tally), intent(inout) :: self
        logical, intent(in) :: there            !! the condition holds
        integer, intent(in) :: checks
        character(*), intent(in) :: name        !! of the checks, and of the condition
        logical :: can

        can = there
        if (there) return
        self%skipped = self%skipped + checks
        write (output_unit, '(a,i0,a)') '  skipped ', checks, ': '//name
    end function provided

    !> Steps, or bodies, of a test that is long: a tenth in a brief run.
    pure function many(self, steps)
        class(tally), intent(in) :: self
        integer, intent(in) :: steps
        integer :: many

        many = merge(steps/10, steps, self%brief)
    end function many

    !> The statement `name` holds when `condition` does.
    subroutine ok(self, name, condition)
        class(tally), intent(inout) :: self
        character(*), intent(in) :: name
        logical, intent(in) :: condition

        if (condition) then
            self%passed = self%passed + 1
        else
            self%failed = self%failed + 1
            write (output_unit, '(a)') '  FAILED '//self%suite//': '//name
        end if
    end subroutine ok

    !> |got - expected| <= tolerance; NaN fails.
    subroutine close_scalar(self, name, got, expected, tolerance)
        class(tally), intent(inout) :: self
        character(*), intent(in) :: name
        real(wp), intent(in) :: got, expected, tolerance

        call self%close_vector(name, [got], [expected], tolerance)
    end subroutine close_scalar

    !> max |got - expected| <= tolerance; NaN and different sizes fail.
    subroutine close_vector(self, name, got, expected, tolerance)
        class(tally), intent(inout) :: self
        character(*), intent(in) :: name
        real(wp), intent(in) :: got(:), expected(:), tolerance
        logical :: good
        integer :: i

        good = size(got) == size(expected)
        if (good) good = all(abs(got - expected) <= tolerance)
        call self%ok(name, good)
        if (.not. good) then
            do i = 1, min(size(got), size(expected))
                write (output_unit, '(4(a,es24.16))') '    got', got(i), ' expected', expected(i), &
                    ' error', got(i) - expected(i), ' tolerance', tolerance
            end do
        end if
    end subroutine close_vector

    !> got <= bound; NaN fails.
    subroutine at_most(self, name, got, bound)
        class(tally), intent(inout) :: self
        character(*), intent(in) :: name
        real(wp), intent(in) :: got, bound

        call self%ok(name, got <= bound)
        if (.not. got <= bound) write (output_unit, '(2(a,es12.4))') '    got', got, ' bound', bound
    end subroutine at_most

    !> got == expected, for integers (counts, status codes).
    subroutine equal(self, name, got, expected)
        class(tally), intent(inout) :: self
        character(*), intent(in) :: name
        integer, intent(in) :: got, expected

        call self%ok(name, got == expected)
        if (got /= expected) write (output_unit, '(a,i0,a,i0)') '    got ', got, ' expected ', expected
    end subroutine equal

    elemental function worst_of_two(old, new) result(worst)
        real(wp), intent(in) :: old, new
        real(wp) :: worst

        worst = huge(1.0_wp)
        if (.not. (ieee_is_nan(old) .or. ieee_is_nan(new))) worst = max(old, new)
    end function worst_of_two

    pure function worst_of_many(old, new) result(worst)
        real(wp), intent(in) :: old, new(:)
        real(wp) :: worst

        worst = worst_of_two(old, largest(new))
    end function worst_of_many

    !> The largest of the scores; NaN counts as huge, and an empty array too.
    pure function largest(scores)
        real(wp), intent(in) :: scores(:)
        real(wp) :: largest

        largest = huge(1.0_wp)
        if (size(scores) > 0 .and. .not. any(ieee_is_nan(scores))) largest = maxval(scores)
    end function largest

end module frb_checks
