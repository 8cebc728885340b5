!> Output files: one record of numbers a line, and no file that looks complete unless the run was.
!>
!> Records go to a temporary file beside the wanted one (its name with `.part` added), which takes the
!> wanted name only when `commit` is called; until then an older file of that name stays as it was.
!> Each number has 17 significant digits, so reading it back gives the same double. Gnuplot and
!> list-directed reads take the lines as they are. A device (a path under /dev/) is written directly.
module frb_out_files
    use frb_kinds, only: wp
    use, intrinsic :: iso_c_binding, only: c_char, c_int, c_null_char
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: out_file

    !> How a number is written, and how many characters that takes.
    character(*), parameter :: record_format = '(*(es25.16e3))'
    integer, parameter :: number_width = 25

    !> An output file, from `open_for_writing` to `commit` or `discard`.
    type :: out_file
        character(:), allocatable :: path   !! the name the file will have
        character(:), allocatable, private :: temporary
        integer, private :: unit = 0
        integer(int64), private :: length = 0   !! of the file so far, in characters
    contains
        procedure :: open_for_writing
        procedure :: write_record
        procedure :: commit
        procedure :: discard
    end type out_file

    interface
        !> POSIX: gives a file another name in one step, replacing a file that had it; 0 if done.
        function c_rename(old, new) bind(c, name='rename') result(failed)
            import :: c_char, c_int
            implicit none
            character(kind=c_char), intent(in) :: old(*), new(*)
            integer(c_int) :: failed
        end function c_rename
    end interface

contains

    !> Opens the temporary file.
    subroutine open_for_writing(self, path, error)
        class(out_file), intent(inout) :: self
        character(*), intent(in) :: path                    !! trailing blanks do not count
        character(:), allocatable, intent(out) :: error     !! allocated if the file cannot be made
        integer :: io

        self%path = trim(path)
        self%length = 0
        self%temporary = self%path//'.part'
        if (index(self%path, '/dev/') == 1) self%temporary = self%path
        open (newunit=self%unit, file=self%temporary, status='unknown', action='write', form='formatted', &
              iostat=io)
        if (io /= 0) error = self%path//': cannot be opened for writing'
    end subroutine open_for_writing

    !> Writes one record as one line.
    subroutine write_record(self, values, error)
        class(out_file), intent(inout) :: self
        real(wp), intent(in) :: values(:)
        character(:), allocatable, intent(out) :: error
        integer :: io

        write (self%unit, record_format, iostat=io) values
        self%length = self%length + number_width*size(values) + len(new_line('a'))
        if (io /= 0) error = self%path//': cannot be written (is the disk full?)'
    end subroutine write_record

    !> Closes the file and gives it its name. On error nothing is left behind.
    subroutine commit(self, error)
        class(out_file), intent(inout) :: self
        character(:), allocatable, intent(out) :: error
        integer(int64) :: length
        integer :: io

        if (self%temporary == self%path) then
            close (self%unit, iostat=io)
            if (io /= 0) error = self%path//': cannot be written'
            return
        end if
        ! Not every run-time library reports a full disk: only the length on the disk tells.
        flush (self%unit, iostat=io)
        inquire (file=self%temporary, size=length)
        if (io /= 0 .or. length /= self%length) then
            call self%discard()
            error = self%path//': cannot be written (is the disk full?)'
            return
        end if
        close (self%unit, iostat=io)
        if (io == 0) io = int(c_rename(self%temporary//c_null_char, self%path//c_null_char))
        if (io /= 0) then
            open (newunit=self%unit, file=self%temporary, status='old', iostat=io)
            if (io == 0) call self%discard()
            error = self%path//': cannot be made (is it a directory?)'
        end if
    end subroutine commit

    !> Removes what was written so far.
    subroutine discard(self)
        class(out_file), intent(inout) :: self
        integer :: io

        if (self%temporary == self%path) then
            close (self%unit, iostat=io)
        else
            close (self%unit, status='delete', iostat=io)
        end if
    end subroutine discard

end module frb_out_files
