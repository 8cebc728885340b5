!> Parts that all charts share: tables with a header that says where they come from, pictures through gnuplot,
!> progress on a terminal, medians and reproducible random numbers. A file that cannot be written ends the
!> program; a file gets its name only when it is complete.
module frb_chart_output
    use frb, only: wp
    use frb_out_files, only: out_file
    use frb_system, only: c_exit, c_getpid
    use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
    use, intrinsic :: iso_c_binding, only: c_int
    use, intrinsic :: iso_fortran_env, only: compiler_options, compiler_version, error_unit, int64
    implicit none
    private

    public :: settings, chart_file, width, open_table, open_script, draw, progress, say, give_up, either, &
        sorted, quantile, uniform, random_direction

    !> Longest line of a table or a script.
    integer, parameter :: width = 400

    !> The options of the command line.
    type :: settings
        logical :: quick = .false.
        logical :: terminal = .false.               !! standard error is a terminal: show progress
        character(:), allocatable :: folder         !! where tables and pictures go
    end type settings

    !> A table or a script that is being written.
    type, extends(out_file) :: chart_file
        character(width) :: line            !! the line that `put` without text writes
    contains
        procedure :: begin
        procedure :: put
        procedure :: put_lines
        procedure :: end_block
        procedure :: finish
    end type chart_file

    !> Okabe and Ito's palette, which colour-blind readers can tell apart, and shared settings.
    character(*), parameter :: palette(*) = [character(9) :: '"#000000"', '"#D55E00"', '"#0072B2"', &
        '"#009E73"', '"#CC79A7"', '"#E69F00"', '"#56B4E9"', '"#999999"']

contains

    !> Opens the file.
    subroutine begin(self, path)
        class(chart_file), intent(inout) :: self
        character(*), intent(in) :: path
        character(:), allocatable :: error

        call self%open_for_writing(path, error)
        if (allocated(error)) call give_up(error)
    end subroutine begin

    !> Writes a line: this text, or the component `line`.
    subroutine put(self, text)
        class(chart_file), intent(inout) :: self
        character(*), intent(in), optional :: text

        if (present(text)) then
            call self%write_line(text)
        else
            call self%write_line(trim(self%line))
        end if
    end subroutine put

    !> Writes lines.
    subroutine put_lines(self, lines)
        class(chart_file), intent(inout) :: self
        character(*), intent(in) :: lines(:)
        integer :: i

        do i = 1, size(lines)
            call self%put(trim(lines(i)))
        end do
    end subroutine put_lines

    !> Ends a block of a table: gnuplot separates blocks by two blank lines.
    subroutine end_block(self)
        class(chart_file), intent(inout) :: self

        call self%put('')
        call self%put('')
    end subroutine end_block

    !> Gives the file its name.
    subroutine finish(self)
        class(chart_file), intent(inout) :: self
        character(:), allocatable :: error

        call self%commit(error)
        if (allocated(error)) call give_up(error)
    end subroutine finish

    !> Opens the table FOLDER/NAME.dat and writes its header: title, machine, compiler, flags, columns.
    subroutine open_table(options, name, title, columns, file)
        type(settings), intent(in) :: options
        character(*), intent(in) :: name, title
        character(*), intent(in) :: columns         !! names and units of the columns
        type(chart_file), intent(out) :: file

        call file%begin(options%folder//'/'//name//'.dat')
        call file%put('# '//title)
        call file%put('# made by: frb_charts'//either(options%quick, ' --quick', ''))
        call file%put('# processor: '//processor())
        call file%put('# compiler: '//compiler_version())
        call file%put('# flags: '//flags())
        call file%put('# columns: '//columns)
    end subroutine open_table

    !> Opens the gnuplot script FOLDER/NAME.gp and writes the common head of all scripts: an SVG of the given
    !> size (a PNG when called as `gnuplot -e "format='png'" NAME.gp`), one font, colours as line types.
    subroutine open_script(options, name, across, height, file)
        type(settings), intent(in) :: options
        character(*), intent(in) :: name
        integer, intent(in) :: across, height       !! of the picture [pixels]
        type(chart_file), intent(out) :: file
        integer :: i

        call file%begin(options%folder//'/'//name//'.gp')
        call file%put('# drawn by: gnuplot '//name//'.gp, in the folder of the tables')
        write (file%line, '(2(a,i0),a)') 'if (!exists("format")) set terminal svg size ', across, ',', &
            height, &
            ' font "Helvetica,15" background "#ffffff"'
        call file%put()
        write (file%line, '(2(a,i0),a)') 'if (exists("format")) set terminal pngcairo size ', across, ',', &
            height, ' font "Helvetica,12"'
        call file%put()
        call file%put('if (!exists("picture")) picture = "'//name//'".(exists("format") ? ".png" : ".svg")')
        call file%put('set encoding utf8')
        call file%put('set output picture')
        do i = 1, size(palette)
            write (file%line, '(a,i0,a)') 'set linetype ', i, ' lc rgb '//trim(palette(i))// &
                ' lw 2 pt 7 ps 0.5'
            call file%put()
        end do
        call file%put('set grid lc rgb "#dddddd" lw 1 lt 1')
        call file%put('set border lc rgb "#444444"')
        call file%put('set tics nomirror')
    end subroutine open_script

    !> Runs gnuplot on FOLDER/NAME.gp; without gnuplot the tables and the script stay.
    subroutine draw(options, name)
        type(settings), intent(in) :: options
        character(*), intent(in) :: name
        character(:), allocatable :: part
        character(12) :: process
        integer :: code, command_code

        call execute_command_line('command -v gnuplot > /dev/null', exitstat=code, cmdstat=command_code)
        if (command_code /= 0 .or. code /= 0) then
            call say('  '//options%folder//'/'//name// &
                '.gp: not drawn, there is no gnuplot; table and script are kept')
            return
        end if
        ! gnuplot does not report a full disk: the picture gets its name only if it is complete.
        write (process, '(i0)') c_getpid()
        part = 'frb-'//trim(process)//'.part'
        call execute_command_line('cd '''//options%folder//''' && { gnuplot -e "picture='''//part//'''" '// &
            name//'.gp && tail -c 16 '//part//' | grep -q "</svg>" && mv -f '//part//' '//name//'.svg || '// &
            '{ rm -f '//part//'; false; }; } 2> /dev/null', exitstat=code, cmdstat=command_code)
        if (command_code /= 0 .or. code /= 0) then
            call give_up(options%folder//'/'//name//'.svg: cannot be drawn (is the disk full?); gnuplot '// &
                         name//'.gp tells more')
        end if
        call say('  '//options%folder//'/'//name//'.svg')
    end subroutine draw

    !> One line on standard output.
    subroutine say(line)
        character(*), intent(in) :: line
        type(chart_file) :: file

        call file%begin('-')
        call file%put(line)
        call file%finish()
    end subroutine say

    !> Ends the program: one line on standard error, exit code 1.
    subroutine give_up(message)
        character(*), intent(in) :: message

        write (error_unit, '(a)') 'frb_charts: '//message
        flush (error_unit)
        call c_exit(1_c_int)
    end subroutine give_up

    !> One text or the other.
    pure function either(condition, yes, no) result(text)
        logical, intent(in) :: condition
        character(*), intent(in) :: yes, no
        character(:), allocatable :: text

        if (condition) then
            text = yes
        else
            text = no
        end if
    end function either

    !> How far a chart has come, on one line of the terminal.
    subroutine progress(options, what, done, of)
        type(settings), intent(in) :: options
        character(*), intent(in) :: what
        integer, intent(in) :: done, of

        if (.not. options%terminal) return
        write (error_unit, '(a,i4,a)', advance='no') achar(13)//what//':', (100*done)/max(of, 1), ' %   '
        if (done >= of) write (error_unit, '(a)', advance='no') achar(13)//repeat(' ', len(what) + 12)// &
            achar(13)
        flush (error_unit)
    end subroutine progress

    !> The flags of this build that change speed or digits; paths and warnings are left out.
    function flags() result(kept)
        character(:), allocatable :: kept
        character(:), allocatable :: rest, word
        integer :: blank

        kept = ''
        rest = compiler_options()//' '
        do while (len(rest) > 0)
            blank = index(rest, ' ')
            word = rest(:blank - 1)
            rest = rest(blank + 1:)
            if (len(word) < 2) cycle
            if (index(word, '/') > 0) cycle
            if (word(:2) == '-O' .or. word(:2) == '-f' .or. word(:6) == '-march') kept = kept//' '//word
        end do
        kept = adjustl(kept)
        if (len(kept) == 0) kept = '(none)'
    end function flags

    !> The processor's name as the system gives it.
    function processor() result(name)
        character(:), allocatable :: name
        character(200) :: line
        integer :: unit, io

        name = 'unknown'
        open (newunit=unit, file='/proc/cpuinfo', status='old', action='read', iostat=io)
        if (io /= 0) return
        do
            read (unit, '(a)', iostat=io) line
            if (io /= 0) exit
            if (line(:10) == 'model name') then
                name = trim(adjustl(line(index(line, ':') + 1:)))
                exit
            end if
        end do
        close (unit)
    end function processor

    !> The values in ascending order; NaN last.
    pure function sorted(values) result(ascending)
        real(wp), intent(in) :: values(:)
        real(wp) :: ascending(size(values))
        real(wp) :: key
        integer :: i, j

        ascending = values
        do i = 2, size(ascending)
            key = ascending(i)
            j = i - 1
            do while (j >= 1)
                if (ascending(j) <= key .or. ieee_is_nan(key)) exit
                ascending(j + 1) = ascending(j)
                j = j - 1
            end do
            ascending(j + 1) = key
        end do
    end function sorted

    !> The value a fraction of the way through the sorted values; 0.5 gives the median.
    pure function quantile(values, fraction) result(value)
        real(wp), intent(in) :: values(:), fraction
        real(wp) :: value
        real(wp) :: ascending(size(values)), place
        integer :: low

        ascending = sorted(values)
        place = 1 + fraction*(size(values) - 1)
        low = min(int(place), size(values) - 1)
        if (size(values) == 1) then
            value = ascending(1)
        else
            value = ascending(low) + (place - low)*(ascending(low + 1) - ascending(low))
        end if
    end function quantile

    !> Uniform random number in (0, 1), the same on every machine (Park and Miller's generator).
    subroutine uniform(seed, x)
        integer(int64), intent(inout) :: seed       !! state, 1 to 2147483646
        real(wp), intent(out) :: x

        seed = mod(48271_int64*seed, 2147483647_int64)
        x = real(seed, wp)/2147483647.0_wp
    end subroutine uniform

    !> Random unit vector, uniform on the sphere.
    subroutine random_direction(seed, v)
        integer(int64), intent(inout) :: seed
        real(wp), intent(out) :: v(3)
        real(wp) :: x(3)

        do
            call uniform(seed, x(1))
            call uniform(seed, x(2))
            call uniform(seed, x(3))
            v = 2*x - 1
            if (sum(v**2) < 1.0_wp .and. sum(v**2) > 0.01_wp) exit
        end do
        v = v/norm2(v)
    end subroutine random_direction

end module frb_chart_output
