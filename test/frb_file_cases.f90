!> Helpers of the suites of files: they write the init file and look for a text in an error.
module frb_file_cases
    implicit none
    private

    public :: nl, path, identity, says, write_text, remove_file

    character(*), parameter :: nl = new_line('a')
    character(*), parameter :: path = 'build/test_init.dat'
    character(*), parameter :: identity = '1 0 0 0 1 0 0 0 1'//nl

contains

    !> Whether there is an error, of one line, that contains this text.
    function says(error, part)
        character(:), allocatable, intent(in) :: error
        character(*), intent(in) :: part
        logical :: says

        says = allocated(error)
        if (says) says = index(error, part) > 0 .and. index(error, nl) == 0
        if (.not. says) then
            print '(a)', '    expected: '//part
            if (allocated(error)) print '(a)', '    got: '//error
        end if
    end function says

    !> Makes the test's init file, byte by byte.
    subroutine write_text(content)
        character(*), intent(in) :: content
        integer :: unit

        call remove_file(path)      ! a file that is written over is flushed to disk, which takes milliseconds
        open (newunit=unit, file=path, status='new', access='stream', form='unformatted', action='write')
        write (unit) content
        close (unit)
    end subroutine write_text

    !> Removes a file if it is there.
    subroutine remove_file(name)
        character(*), intent(in) :: name
        integer :: unit, io

        open (newunit=unit, file=name, status='old', iostat=io)
        if (io == 0) close (unit, status='delete')
    end subroutine remove_file

end module frb_file_cases
