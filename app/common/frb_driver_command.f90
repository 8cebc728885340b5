!> The command line of the driver programs: `driver_exampleN [INIT] [-o OUT]`, `--help`, `--version`; for
!> example 1 also `--scheme NAME` and `--drift NAME`.
!>
!> Every error is one line on standard error, with exit code 1.
module frb_driver_command
    use frb, only: scheme_names
    use frb_init_files, only: init_values, read_init_file
    use frb_out_files, only: out_file
    use frb_system, only: c_exit, full_files_are_errors
    use frb_release, only: version
    use, intrinsic :: iso_c_binding, only: c_int
    use, intrinsic :: iso_fortran_env, only: error_unit
    implicit none
    private

    public :: run_command, read_command, begin_run, fail, fail_run, joined

    !> The contents of the command line.
    type :: run_command
        character(:), allocatable :: init_path, out_path
        character(:), allocatable :: scheme     !! its name, '' if none is given
        character(:), allocatable :: drift      !! its name, '' if none is given
    end type run_command

    !> For --help: the purpose of each program, and the contents of a record of its output.
    character(*), parameter :: purposes(0:4) = [character(80) :: &
        'the motion of a free rigid body, one step of size h, attitude a matrix', &
        'a heavy top, by splitting around the free rigid body', &
        'the motion of a free rigid body, one step of size h, attitude a quaternion', &
        'the motion of a free rigid body in N steps, attitude a matrix', &
        'the motion of a free rigid body in N steps, attitude a quaternion']
    character(*), parameter :: records(0:4) = [character(80) :: &
        'm(3), Q(9) column by column, t; at the start and at the end', &
        'm(3), Q(9) column by column, t; at the start and after every step', &
        'm(3), q(4) scalar first, t; at the start and at the end', &
        'm(3), Q(9) column by column, t; at the start and after every step', &
        'm(3), q(4) scalar first, t; at the start and after every step']

contains

    !> Reads the init file, then opens the output. An error ends the program.
    subroutine begin_run(example, command, values, out)
        integer, intent(in) :: example              !! 0 to 4
        type(run_command), intent(in) :: command
        type(init_values), intent(out) :: values
        type(out_file), intent(out) :: out
        character(:), allocatable :: error

        call full_files_are_errors()
        call read_init_file(command%init_path, example, values, error, command%out_path)
        if (allocated(error)) call fail(error)
        call out%open_for_writing(command%out_path, error)
        if (allocated(error)) call fail(error)
    end subroutine begin_run

    !> Ends the program: one line on standard error, exit code 1.
    subroutine fail(message)
        character(*), intent(in) :: message

        write (error_unit, '(a)') 'error: '//message
        flush (error_unit)
        call c_exit(1_c_int)
    end subroutine fail

    !> Ends a run that cannot go on, and removes its output.
    subroutine fail_run(out, message)
        type(out_file), intent(inout) :: out
        character(*), intent(in) :: message

        call out%discard()
        call fail(message)
    end subroutine fail_run

    !> Reads the command line; where it does not name the init file or the output, they have their defaults.
    subroutine read_command(example, command)
        integer, intent(in) :: example              !! 0 to 4
        type(run_command), intent(out) :: command
        character(:), allocatable :: word
        character :: digit
        logical :: options
        integer :: i

        digit = achar(iachar('0') + example)
        options = .true.
        command = run_command('', '', '', '')
        i = 0
        do while (i < command_argument_count())
            i = i + 1
            word = argument(i)
            if (options .and. word == '--') then
                options = .false.
            else if (options .and. (word == '--help' .or. word == '-h')) then
                call tell(help(example))
            else if (options .and. word == '--version') then
                call tell('driver_example'//digit//' (frb) '//version)
            else if (options .and. word == '-o') then
                call take_value(word, 'a file', i, command%out_path)
            else if (options .and. example == 1 .and. word == '--scheme') then
                call take_value(word, 'a scheme', i, command%scheme)
            else if (options .and. example == 1 .and. word == '--drift') then
                call take_value(word, 'a drift', i, command%drift)
            else if (options .and. index(word, '-') == 1 .and. word /= '-') then
                call fail('unknown option '//word//' (see --help)')
            else if (len(command%init_path) > 0) then
                call fail('more than one init file: '//word//' (see --help)')
            else if (len_trim(word) == 0) then
                call fail('the name of the init file is empty (see --help)')
            else
                command%init_path = word
            end if
        end do
        if (len(command%init_path) == 0) command%init_path = 'data/init_example'//digit//'.dat'
        if (len(command%out_path) == 0) command%out_path = 'out_example'//digit//'.dat'
    end subroutine read_command

    !> Reads the value of an option, which is the argument after the option.
    subroutine take_value(option, what, i, value)
        character(*), intent(in) :: option, what
        integer, intent(inout) :: i                                 ! the option's place, then the value's
        character(:), allocatable, intent(inout) :: value           ! '' before

        i = i + 1
        if (i > command_argument_count()) call fail(option//' needs the name of '//what//' (see --help)')
        if (len(value) > 0) call fail('more than one '//option//' (see --help)')
        value = argument(i)
        if (len_trim(value) == 0) call fail(option//' needs the name of '//what//' (see --help)')
    end subroutine take_value

    !> One argument of the command line.
    function argument(i) result(word)
        integer, intent(in) :: i
        character(:), allocatable :: word
        integer :: length

        call get_command_argument(i, length=length)
        allocate (character(length) :: word)
        if (length > 0) call get_command_argument(i, word)
    end function argument

    !> The text of --help.
    pure function help(example) result(text)
        integer, intent(in) :: example
        character(:), allocatable :: text
        character(*), parameter :: nl = new_line('a')
        character :: digit
        character(:), allocatable :: more_usage, more_options

        digit = achar(iachar('0') + example)
        more_usage = ''
        more_options = ''
        if (example == 1) then
            more_usage = ' [--scheme NAME] [--drift NAME]'
            more_options = &
                '  --scheme   one of these in place of the file''s coefficients:'//nl// &
                '             '//joined(scheme_names)//nl// &
                '  --drift    the free body by free_flow (default), frb_step or quat_step, exact, or'//nl// &
                '             by frb_step:N or quat_step:N, semi-exact with N Gauss points'//nl
        end if
        text = 'usage: driver_example'//digit//' [INIT] [-o OUT]'//more_usage//nl// &
               'Computes '//trim(purposes(example))//'.'//nl//nl// &
               '  INIT       input, data/init_example'//digit// &
                           '.dat by default; data/README.md has the format'//nl// &
               '  -o OUT     output, out_example'//digit//'.dat by default; one record a line:'//nl// &
               '             '//trim(records(example))//nl// &
               '  -          in the place of INIT or OUT: standard input or output'//nl// &
               more_options// &
               '  --help     this text'//nl// &
               '  --version  name and version'
    end function help

    !> Words in one line.
    pure function joined(words) result(line)
        character(*), intent(in) :: words(:)
        character(:), allocatable :: line
        integer :: i

        line = trim(words(1))
        do i = 2, size(words)
            line = line//' '//trim(words(i))
        end do
    end function joined

    !> Ends the program with a text on standard output.
    subroutine tell(text)
        character(*), intent(in) :: text
        type(out_file) :: out
        character(:), allocatable :: error

        call out%open_for_writing('-', error)
        if (.not. allocated(error)) then
            call out%write_line(text)
            call out%commit(error)
        end if
        if (allocated(error)) call fail(error)
        call c_exit(0_c_int)
    end subroutine tell

end module frb_driver_command
