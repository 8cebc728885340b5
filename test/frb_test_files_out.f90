!> Output files, whose lines are read back, and the version.
module frb_test_files_out
    use frb_checks, only: tally
    use frb_file_cases, only: remove_file, says
    use frb_kinds, only: wp
    use frb_out_files, only: out_file
    use frb_system, only: c_getpid
    use frb_release, only: version
    implicit none
    private

    public :: test_files_out

contains

    subroutine test_files_out(t)
        type(tally), intent(inout) :: t

        call test_out(t)
        call test_temporary(t)
        call test_direct(t)
        call test_version(t)
    end subroutine test_files_out

    !> Records are read back with the same values; a failed run leaves no file that looks complete.
    subroutine test_out(t)
        type(tally), intent(inout) :: t
        character(*), parameter :: out_path = 'build/test_out.dat'
        real(wp), parameter :: record(4) = [0.1_wp, -1.0_wp/3, 1.0e-300_wp, -1.7976931348623157e308_wp]
        integer, parameter :: nothing = 0, only_whole = 1, only_part = 2
        type(out_file) :: out
        character(:), allocatable :: error
        real(wp) :: back(4, 2)
        integer :: unit, io

        call t%open_suite('files-out', 11)
        call remove_file(out_path)
        call out%open_for_writing(out_path, error)
        call t%ok('output-opens', .not. allocated(error))
        call out%write_record(record, error)
        call t%equal('output-has-no-name-before-it-is-complete', traces(out_path), only_part)
        call out%discard()
        call t%equal('discarded-output-leaves-nothing', traces(out_path), nothing)

        call out%open_for_writing(out_path, error)
        call out%write_record(record, error)
        call out%write_record(-record, error)
        call out%commit(error)
        call t%ok('output-is-committed', .not. allocated(error))
        call t%equal('committed-output-has-its-name', traces(out_path), only_whole)
        open (newunit=unit, file=out_path, status='old', action='read')
        read (unit, *) back(:, 1)
        read (unit, *) back(:, 2)
        call t%close_to('records-come-back-to-the-last-bit', [back(:, 1), -back(:, 2)], [record, record], &
                    0.0_wp)
        read (unit, *, iostat=io) back(:, 1)
        call t%ok('a-record-is-a-line', is_iostat_end(io))
        close (unit)

        call out%open_for_writing(out_path, error)
        call out%discard()
        call t%equal('failed-run-keeps-the-older-output', traces(out_path), only_whole)
        call out%open_for_writing('build/no_such_folder/out.dat', error)
        call t%ok('output-in-a-missing-folder-is-refused', says(error, &
                    'build/no_such_folder/out.dat: cannot'))
        call out%open_for_writing('build', error)
        if (.not. allocated(error)) call out%commit(error)
        call t%ok('output-that-is-a-folder-is-refused', says(error, 'build: cannot be made'))
        call t%equal('refused-output-leaves-nothing', traces('build'), only_whole)
        call t%close_suite()
    end subroutine test_out

    !> Each output of each process has its own temporary file: an existing file of that name, or OUT.part, is
    !> kept, and two outputs of one name do not mix.
    subroutine test_temporary(t)
        type(tally), intent(inout) :: t
        character(*), parameter :: out_path = 'build/test_out.dat'
        type(out_file) :: first, second
        character(:), allocatable :: error
        character(80) :: line
        integer :: unit, i

        call t%open_suite('files-temporary', 6)
        open (newunit=unit, file=out_path//'.part', action='write')
        write (unit, '(a)') 'notes'
        close (unit)
        open (newunit=unit, file=temporary_of('build/'), action='write')
        write (unit, '(a)') 'notes'
        close (unit)
        call first%open_for_writing(out_path, error)
        call second%open_for_writing(out_path, error)
        do i = 1, 3
            call first%write_line('first')
            call second%write_line('second')
        end do
        call first%commit(error)
        call t%ok('first-of-two-outputs-is-committed', .not. allocated(error))
        call t%equal('first-of-two-outputs-has-its-lines', lines_of(out_path, 'first'), 3)
        call second%commit(error)
        call t%equal('second-of-two-outputs-has-its-lines', lines_of(out_path, 'second'), 3)
        call first%open_for_writing(out_path, error)
        call first%discard()
        call t%equal('a-file-of-the-user-is-kept', lines_of(out_path//'.part', 'notes'), 1)
        call t%equal('a-file-with-the-temporary-name-is-kept', lines_of(temporary_of('build/'), 'notes'), 1)
        call remove_file(temporary_of('build/'))
        call remove_file(out_path//'.part')
        open (newunit=unit, file=out_path, action='read', access='stream', form='formatted')
        read (unit, '(a)') line
        inquire (unit=unit, pos=i)
        close (unit)
        call t%equal('a-line-ends-with-one-byte', i, len('second') + 2)
        call t%close_suite()
    end subroutine test_temporary

    !> An output that cannot be replaced is written directly, and a full device is an error.
    subroutine test_direct(t)
        type(tally), intent(inout) :: t
        type(out_file) :: out
        character(:), allocatable :: error
        logical :: there
        integer :: i

        call t%open_suite('files-direct', 4)
        inquire (file='/dev/full', exist=there)
        if (t%provided(there, 4, 'output to a full device (/dev/full)')) then
            call out%open_for_writing('/dev/full', error)
            call t%ok('a-device-is-opened', .not. allocated(error))
            call out%write_line('a short line')
            call out%commit(error)
            call t%ok('a-full-device-is-told-at-the-end', says(error, '/dev/full: cannot be written'))
            call out%open_for_writing('/dev/full', error)
            do i = 1, 1000
                call out%write_record([1.0_wp, 2.0_wp, 3.0_wp], error)
                if (allocated(error)) exit
            end do
            call t%ok('a-full-device-is-told-on-the-way', says(error, '/dev/full: cannot be written'))
            call out%discard()
            call t%equal('a-device-has-no-temporary-file', traces('/dev/full'), 1)
        end if
        call t%close_suite()
    end subroutine test_direct

    !> The version the drivers print is that of the package.
    subroutine test_version(t)
        type(tally), intent(inout) :: t
        character(200) :: line
        logical :: found
        integer :: unit, io

        call t%open_suite('version', 1)
        found = .false.
        open (newunit=unit, file='fpm.toml', status='old', action='read')
        do
            read (unit, '(a)', iostat=io) line
            if (io /= 0) exit
            if (line == 'version = "'//version//'"') found = .true.
        end do
        close (unit)
        call t%ok('version-is-that-of-the-manifest', found)
        call t%close_suite()
    end subroutine test_version

    !> Files that exist of an output: 1 for the file itself, plus 2 for its unfinished part.
    function traces(name)
        character(*), intent(in) :: name
        integer :: traces
        logical :: whole, part

        inquire (file=name, exist=whole)
        inquire (file=temporary_of(name(:index(name, '/', back=.true.))), exist=part)
        traces = merge(1, 0, whole) + merge(2, 0, part)
    end function traces

    !> The name of the first temporary file of this process in a folder.
    function temporary_of(folder) result(name)
        character(*), intent(in) :: folder
        character(:), allocatable :: name
        character(12) :: process

        write (process, '(i0)') c_getpid()
        name = folder//'frb-'//trim(process)//'-1.part'
    end function temporary_of

    !> The number of lines of a file whose lines all are `text`; -1 if there is another line.
    function lines_of(name, text) result(lines)
        character(*), intent(in) :: name, text
        integer :: lines
        character(80) :: line
        integer :: unit, io

        lines = 0
        open (newunit=unit, file=name, status='old', action='read', iostat=io)
        do while (io == 0)
            read (unit, '(a)', iostat=io) line
            if (io /= 0) exit
            lines = lines + 1
            if (line /= text) then
                lines = -1
                exit
            end if
        end do
        close (unit, iostat=io)
    end function lines_of

end module frb_test_files_out
