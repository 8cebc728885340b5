!> The routines of C and POSIX that the library calls, for streams that report a full disk, names of files and
!> the process, and two procedures made of them.
module frb_system
    use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_int, c_intptr_t, c_long, c_null_char, &
        c_ptr, c_size_t
    implicit none
    private

    public :: c_fopen, c_fdopen, c_fwrite, c_ftell, c_fflush, c_fclose
    public :: full_files_are_errors, without_links, longest_path
    public :: c_rename, c_remove, c_readlink, c_getpid, c_geteuid, c_isatty, c_exit

    !> Longest path that links may lead to.
    integer, parameter :: longest_path = 4096

    interface
        !> C: opens a file; comes back with a null pointer if the file cannot be opened.
        function c_fopen(path, mode) bind(c, name='fopen') result(stream)
            import :: c_char, c_ptr
            implicit none
            character(kind=c_char), intent(in) :: path(*), mode(*)
            type(c_ptr) :: stream
        end function c_fopen

        !> POSIX: a stream of a descriptor that is open: 1 is standard output, 2 standard error.
        function c_fdopen(descriptor, mode) bind(c, name='fdopen') result(stream)
            import :: c_char, c_int, c_ptr
            implicit none
            integer(c_int), value :: descriptor
            character(kind=c_char), intent(in) :: mode(*)
            type(c_ptr) :: stream
        end function c_fdopen

        !> C: writes a number of items of one size; comes back with the number of items written.
        function c_fwrite(text, item, items, stream) bind(c, name='fwrite') result(written)
            import :: c_char, c_ptr, c_size_t
            implicit none
            character(kind=c_char), intent(in) :: text(*)
            integer(c_size_t), value :: item, items
            type(c_ptr), value :: stream
            integer(c_size_t) :: written
        end function c_fwrite

        !> C: the place in a stream, negative if the stream has no places, as a pipe.
        function c_ftell(stream) bind(c, name='ftell') result(place)
            import :: c_long, c_ptr
            implicit none
            type(c_ptr), value :: stream
            integer(c_long) :: place
        end function c_ftell

        !> C: writes the characters of a stream that are still in memory; 0 if done.
        function c_fflush(stream) bind(c, name='fflush') result(failed)
            import :: c_int, c_ptr
            implicit none
            type(c_ptr), value :: stream
            integer(c_int) :: failed
        end function c_fflush

        !> C: writes the characters still in memory and closes the stream; 0 if done.
        function c_fclose(stream) bind(c, name='fclose') result(failed)
            import :: c_int, c_ptr
            implicit none
            type(c_ptr), value :: stream
            integer(c_int) :: failed
        end function c_fclose

        !> C: gives a file another name in one step, and replaces a file of that name; 0 if done.
        function c_rename(old, new) bind(c, name='rename') result(failed)
            import :: c_char, c_int
            implicit none
            character(kind=c_char), intent(in) :: old(*), new(*)
            integer(c_int) :: failed
        end function c_rename

        !> C: removes a file; 0 if done.
        function c_remove(path) bind(c, name='remove') result(failed)
            import :: c_char, c_int
            implicit none
            character(kind=c_char), intent(in) :: path(*)
            integer(c_int) :: failed
        end function c_remove

        !> POSIX: the path that a link holds, and its length, negative if `path` is no link.
        function c_readlink(path, text, size) bind(c, name='readlink') result(length)
            import :: c_char, c_size_t
            implicit none
            character(kind=c_char), intent(in) :: path(*)
            character(kind=c_char), intent(out) :: text(*)
            integer(c_size_t), value :: size
            integer(c_size_t) :: length
        end function c_readlink

        !> POSIX: the path of a file without links, into a text of 4096 characters; null if there is no file.
        function c_realpath(path, text) bind(c, name='realpath') result(name)
            import :: c_char, c_ptr
            implicit none
            character(kind=c_char), intent(in) :: path(*)
            character(kind=c_char), intent(inout) :: text(*)
            type(c_ptr) :: name
        end function c_realpath

        !> POSIX: the number of this process.
        function c_getpid() bind(c, name='getpid') result(process)
            import :: c_int
            implicit none
            integer(c_int) :: process
        end function c_getpid

        !> POSIX: the user whose rights this process has; 0 is root.
        function c_geteuid() bind(c, name='geteuid') result(user)
            import :: c_int
            implicit none
            integer(c_int) :: user
        end function c_geteuid

        !> POSIX: 1 if a descriptor is a terminal.
        function c_isatty(descriptor) bind(c, name='isatty') result(terminal)
            import :: c_int
            implicit none
            integer(c_int), value :: descriptor
            integer(c_int) :: terminal
        end function c_isatty

        !> C: ends the program with an exit code; unlike `stop` it prints nothing.
        subroutine c_exit(code) bind(c, name='exit')
            import :: c_int
            implicit none
            integer(c_int), value :: code
        end subroutine c_exit

        !> C: sets the action for a signal; comes back with the action before.
        function c_signal(signal, action) bind(c, name='signal') result(before)
            import :: c_int, c_intptr_t
            implicit none
            integer(c_int), value :: signal
            integer(c_intptr_t), value :: action
            integer(c_intptr_t) :: before
        end function c_signal
    end interface

contains

    !> Makes a file that grows beyond the limit of the shell an error of writing, like a full disk; otherwise
    !> the signal of the system ends the program.
    subroutine full_files_are_errors()
        integer(c_int), parameter :: file_too_large = 25
        integer(c_intptr_t), parameter :: ignored = 1
        integer(c_intptr_t) :: before

        before = c_signal(file_too_large, ignored)
    end subroutine full_files_are_errors

    !> The path of a file from the root, without links and dots; '' if there is no such file.
    function without_links(path) result(whole)
        character(*), intent(in) :: path
        character(:), allocatable :: whole
        character(longest_path) :: text

        whole = ''
        text = ''
        if (c_associated(c_realpath(path//c_null_char, text))) whole = text(:index(text, c_null_char) - 1)
    end function without_links

end module frb_system
