!> Output files: lines of text or of numbers. A file gets its name only after a complete run.
!>
!> Lines go to a temporary file of this process (`frb-PROCESS-NUMBER.part`) in the folder of the wanted file.
!> `commit` gives this file the wanted name; until then an older file of that name stays as it was. A link is
!> followed: the file that it leads to is replaced. Standard output (`-` or /dev/stdout), devices and pipes
!> cannot be replaced and are written directly.
!>
!> Each number has 17 significant digits, so reading it back gives the same double. Gnuplot and list-directed
!> reads accept the lines. All writing is done by C and POSIX, which report a full disk; the run-time
!> libraries of Fortran do not always.
module frb_out_files
    use frb_kinds, only: wp
    use frb_system, only: c_fclose, c_fdopen, c_fflush, c_fopen, c_ftell, c_fwrite, c_geteuid, c_getpid, &
        c_readlink, c_remove, c_rename, longest_path, without_links
    use, intrinsic :: iso_c_binding, only: c_associated, c_int, c_null_char, c_null_ptr, c_ptr, c_size_t
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: out_file, is_special

    !> Format of a number, and its number of characters.
    character(*), parameter :: record_format = '(*(es25.16e3))'
    integer, parameter :: number_width = 25

    !> An output file, from `open_for_writing` to `commit` or `discard`.
    type :: out_file
        character(:), allocatable :: path   !! as the caller gave it
        integer :: descriptor = 0           !! 1: it is standard output, 2: standard error
        character(:), allocatable, private :: target_path   !! the file that its links lead to
        character(:), allocatable, private :: temporary     !! name of the temporary file; '' if there is none
        type(c_ptr), private :: stream = c_null_ptr
        integer(int64), private :: length = 0   !! of all lines written, in bytes
        logical, private :: broken = .false.    !! something could not be written
    contains
        procedure :: open_for_writing
        procedure :: write_line
        procedure :: write_record
        procedure :: commit
        procedure :: discard
        procedure, private :: open_temporary
        procedure, private :: close_stream
        procedure, private :: full
    end type out_file

contains

    !> Opens the temporary file, or the device, pipe or standard output that is written directly.
    subroutine open_for_writing(self, path, error)
        class(out_file), intent(out) :: self
        character(*), intent(in) :: path                    !! -: standard output; no blanks at its end
        character(:), allocatable, intent(out) :: error     !! allocated if the file cannot be made
        logical :: exists, direct

        self%path = trim(path)
        self%target_path = followed(self%path)
        self%temporary = ''
        inquire (file=self%target_path, exist=exists)
        select case (self%target_path)
        case ('-', '/dev/stdout', '/dev/fd/1', '/proc/self/fd/1')
            self%descriptor = 1
        case ('/dev/stderr', '/dev/fd/2', '/proc/self/fd/2')
            self%descriptor = 2
        case default
            ! A file that is opened to append keeps its contents.
            if (exists) self%stream = c_fopen(self%target_path//c_null_char, 'a'//c_null_char)
            if (exists .and. .not. c_associated(self%stream)) then
                error = self%path//': cannot be made (is it a directory, or read-only?)'
                return
            end if
            if (exists) then
                direct = is_device(self%target_path)
                if (.not. direct) direct = c_ftell(self%stream) < 0
                if (direct) return
                exists = c_fclose(self%stream) == 0
                self%stream = c_null_ptr
                if (is_marked_read_only(self%target_path)) then
                    error = self%path//': cannot be made (it is read-only)'
                    return
                end if
            end if
            call self%open_temporary()
        end select
        if (self%descriptor > 0) self%stream = c_fdopen(int(self%descriptor, c_int), 'w'//c_null_char)
        if (.not. c_associated(self%stream)) error = self%path//': cannot be opened for writing'
    end subroutine open_for_writing

    !> Writes one line of text. If this fails, the error comes back here, or from `commit` at the latest.
    subroutine write_line(self, text, error)
        class(out_file), intent(inout) :: self
        character(*), intent(in) :: text
        character(:), allocatable, intent(out), optional :: error
        integer(c_size_t) :: length

        length = len(text, c_size_t) + 1
        if (c_fwrite(text//new_line('a'), 1_c_size_t, length, self%stream) /= length) self%broken = .true.
        self%length = self%length + length
        if (present(error) .and. self%broken) error = self%full()
    end subroutine write_line

    !> Writes one record as one line.
    subroutine write_record(self, values, error)
        class(out_file), intent(inout) :: self
        real(wp), intent(in) :: values(:)
        character(:), allocatable, intent(out) :: error
        character(number_width*size(values)) :: text

        write (text, record_format) values
        call self%write_line(text, error)
    end subroutine write_record

    !> Closes the file and gives it its name. On error nothing is left behind.
    subroutine commit(self, error)
        class(out_file), intent(inout) :: self
        character(:), allocatable, intent(out) :: error
        integer(int64) :: length

        call self%close_stream()
        if (len(self%temporary) > 0) then
            ! The stream is closed: the system tells the length on the disk.
            inquire (file=self%temporary, size=length)
            if (length /= self%length) self%broken = .true.
        end if
        if (self%broken) then
            error = self%full()
        else if (len(self%temporary) > 0) then
            if (c_rename(self%temporary//c_null_char, self%target_path//c_null_char) == 0) return
            error = self%path//': cannot be made (is it a directory, or read-only?)'
        end if
        if (allocated(error)) call self%discard()
    end subroutine commit

    !> Closes and removes the temporary file.
    subroutine discard(self)
        class(out_file), intent(inout) :: self
        logical :: removed

        call self%close_stream()
        if (len(self%temporary) > 0) removed = c_remove(self%temporary//c_null_char) == 0
    end subroutine discard

    !> Whether a path lies where the system keeps devices and open files; /dev/shm/ holds ordinary files, and
    !> so do folders that a process sees under /proc/, such as /proc/self/cwd/.
    pure function is_special(path) result(special)
        character(*), intent(in) :: path
        logical :: special

        special = index(path, '/dev/') == 1 .and. index(path, '/dev/shm/') /= 1
        special = special .or. (index(path, '/proc/') == 1 .and. index(path, '/fd/') > 0)
    end function is_special

    ! ------------------------------------------------------------------------------------------ inner parts

    !> Makes the temporary file, under a name that no other file has.
    subroutine open_temporary(self)
        class(out_file), intent(inout) :: self
        integer, parameter :: most_tried = 1000000
        character(32) :: name
        logical :: taken
        integer :: i

        do i = 1, most_tried
            write (name, '(2(a,i0),a)') 'frb-', c_getpid(), '-', i, '.part'
            self%temporary = folder(self%target_path)//trim(name)
            self%stream = c_fopen(self%temporary//c_null_char, 'wbx'//c_null_char)
            if (c_associated(self%stream)) return
            inquire (file=self%temporary, exist=taken)
            if (.not. taken) return
        end do
    end subroutine open_temporary

    !> Writes the characters still in memory, and closes a file; standard output stays open.
    subroutine close_stream(self)
        class(out_file), intent(inout) :: self
        integer(c_int) :: failed

        if (.not. c_associated(self%stream)) return
        if (self%descriptor > 0) then
            failed = c_fflush(self%stream)
        else
            failed = c_fclose(self%stream)
        end if
        if (failed /= 0) self%broken = .true.
        self%stream = c_null_ptr
    end subroutine close_stream

    !> The message of an error of writing.
    pure function full(self) result(error)
        class(out_file), intent(in) :: self
        character(:), allocatable :: error

        error = self%path//': cannot be written (is the disk full?)'
    end function full

    !> The path at the end of a chain of links, '' if the chain has more than 40 links. A new file takes the
    !> place of the file there, and the links stay. Paths of devices and of open files come back unchanged.
    function followed(path) result(name)
        character(*), intent(in) :: path
        character(:), allocatable :: name
        integer, parameter :: most_links = 40
        character(longest_path) :: text
        integer :: length, i

        name = path
        do i = 1, most_links
            if (is_special(name)) return
            length = int(c_readlink(name//c_null_char, text, len(text, c_size_t)))
            if (length < 1) return
            if (text(1:1) /= '/') name = folder(name)//text(:length)
            if (text(1:1) == '/') name = text(:length)
        end do
        name = ''
    end function followed

    !> Whether nobody has the right to write to an existing file. Needed for root only, who can write to such
    !> a file nevertheless: the command `find` shows the rights, opening the file does not.
    function is_marked_read_only(path) result(read_only)
        character(*), intent(in) :: path
        logical :: read_only
        character(:), allocatable :: quoted
        integer :: code, command_code, i

        read_only = .false.
        if (c_geteuid() /= 0) return
        quoted = ''
        if (path(1:1) /= '/') quoted = './'
        do i = 1, len(path)
            if (path(i:i) == '''') quoted = quoted//'''\'''
            quoted = quoted//path(i:i)
        end do
        call execute_command_line("test -n ""$(find '"//quoted//"' -prune ! -perm -200 ! -perm -020 "// &
                                  "! -perm -002)""", exitstat=code, cmdstat=command_code)
        read_only = command_code == 0 .and. code == 0
    end function is_marked_read_only

    !> Whether an existing file is a device, by any name or link.
    function is_device(path) result(device)
        character(*), intent(in) :: path
        logical :: device

        device = is_special(path)
        if (.not. device) device = is_special(without_links(path))
    end function is_device

    !> The folder of a path, with its slash; '' if it has none.
    pure function folder(path)
        character(*), intent(in) :: path
        character(:), allocatable :: folder

        folder = path(:index(path, '/', back=.true.))
    end function folder

end module frb_out_files
