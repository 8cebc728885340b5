!> Published numbers are met to the digits their sources support, and the table in data/ is current.
module frb_test_published
    use frb_checks, only: tally
    use frb_kinds, only: wp
    use frb_published, only: published_row, published_rows
    implicit none
    private

    public :: test_published, print_published

    character(*), parameter :: table = 'data/published.dat'
    real(wp), parameter :: rounding = 0.6e-12_wp, twelve_digits = 1.0e-12_wp
    character(*), parameter :: form = '(a48,a40,es21.12,es21.12,es11.2)'

contains

    subroutine test_published(t)
        type(tally), intent(inout) :: t
        type(published_row), allocatable :: rows(:)
        real(wp) :: stated(2)
        character(200) :: line
        integer :: unit, io, i

        call t%open_suite('published', 97)
        call published_rows(rows)
        open (newunit=unit, file=table, status='old', action='read')
        do i = 1, size(rows)
            associate (row => rows(i))
                call t%close_to(trim(row%what)//' is that of '//row%source, row%ours, row%published, &
                                row%bound)
                do
                    read (unit, '(a)', iostat=io) line
                    if (io /= 0 .or. line(1:1) /= '#') exit
                end do
                stated = 0.0_wp
                if (io == 0) read (line(89:130), *, iostat=io) stated
                call t%ok('the table states '//row%what, io == 0 .and. line(:48) == row%what &
                          .and. all(abs(stated - [row%published, row%ours]) &
                                    <= rounding*abs(row%ours) + min(row%bound, twelve_digits)))
            end associate
        end do
        read (unit, '(a)', iostat=io) line
        call t%ok('the-table-ends-with-the-last-row', io /= 0)
        close (unit)
        call t%close_suite()
    end subroutine test_published

    !> The table, as it stands in data/published.dat.
    subroutine print_published()
        type(published_row), allocatable :: rows(:)
        integer :: i

        call published_rows(rows)
        print '(a)', '# published numbers on moving bodies, and what the library gives'
        print '(a)', '# made by: fpm test -- --published'
        print '(a)', '# columns: what, source, published, frb, difference'
        do i = 1, size(rows)
            associate (row => rows(i))
                print form, row%what, row%source, row%published, row%ours, row%ours - row%published
            end associate
        end do
    end subroutine print_published

end module frb_test_published
