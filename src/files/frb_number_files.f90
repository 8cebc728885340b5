!> Files of numbers, read item by item as Fortran's list-directed input reads them. Every error message names
!> the file, the line and the item.
!>
!> Values are separated by blanks, tabs or line ends, with at most one comma between two values; `3*0.5`
!> stands for three values. A number is an optional sign, digits with an optional point, and an optional
!> exponent: E, D or Q, in either case, and a whole number; or a signed whole number alone (`1+5`). Words
!> after the last number of an item are ignored to the end of the line. A list-directed read leaves a variable
!> unset where two commas have nothing between them, for `3*` and for a slash: here these are errors.
!>
!> Further, a comment runs from # or ! to the end of its line, several items may share a line, and a byte
!> order mark of UTF-8 is skipped. If something is wrong, `error` comes back allocated, as one line of text.
module frb_number_files
    use frb_kinds, only: wp
    use frb_number_words, only: is_blank, is_too_large, is_value, quoted, split_value
    use frb_out_files, only: is_special
    use frb_system, only: without_links
    use, intrinsic :: iso_fortran_env, only: input_unit
    implicit none
    private

    public :: number_file, largest_magnitude

    !> Larger numbers are refused: squares and products of two accepted numbers stay finite.
    real(wp), parameter :: largest_magnitude = 1.0e100_wp

    !> Longest line accepted: a file without line ends is refused before it fills the memory.
    integer, parameter :: longest_line = 100000

    !> Number of characters that one read takes from the file.
    integer, parameter :: piece = 512

    !> A line of the file that is not blank, without its comment.
    type :: text_line
        integer :: number = 0
        character(:), allocatable :: text
    end type text_line

    !> A file open for reading, and the place reached in it. Its lines are kept, so that any file, standard
    !> input too, can be read again from the first number.
    type :: number_file
        character(:), allocatable :: path           !! as the caller gave it
        integer :: line_number = 0                  !! of the number read last; 0 before the first
        character(:), allocatable :: surplus        !! error about the first number that `by_lines` dropped
        type(text_line), allocatable, private :: lines(:)
        character(:), allocatable, private :: buffer    !! for the line that is being read
        character(:), allocatable, private :: last      !! name of the item read last, with its size
        character(:), allocatable, private :: word      !! the number read last, as it is written
        real(wp), private :: value = 0.0_wp         !! the number read last
        integer, private :: repeats = 0             !! how many more times this number is to be given
        logical, private :: comma_may_follow = .false.
        logical, private :: by_lines = .false.      !! every item starts on a new line
        integer, private :: kept = 0                !! number of lines kept
        integer, private :: current = 0             !! the kept line that holds the place reached
        integer, private :: position = 1            !! the place in this line
        integer, private :: lines_read = 0          !! number of lines read, blank lines too
        integer, private :: unit = 0
        logical, private :: at_end = .false.
    contains
        procedure :: open_for_reading
        procedure :: is_file
        procedure :: start_over
        procedure :: read_number
        procedure :: read_numbers
        procedure :: expect_end
        procedure :: complaint
        procedure :: close_file
        procedure, private :: begin_item
        procedure, private :: next_number
        procedure, private :: find_word
        procedure, private :: word_here
        procedure, private :: next_line
        procedure, private :: keep_line
    end type number_file

contains

    !> Opens a file for reading.
    subroutine open_for_reading(self, path, error)
        class(number_file), intent(out) :: self
        character(*), intent(in) :: path                    !! -: standard input; no blanks at its end
        character(:), allocatable, intent(out) :: error     !! allocated if it cannot be opened
        integer :: io

        self%path = trim(path)
        self%last = 'the start'
        self%word = ''
        allocate (self%lines(64))
        allocate (character(longest_line + piece) :: self%buffer)
        if (self%path == '-') then
            self%path = 'standard input'
            self%unit = input_unit
            return
        end if
        open (newunit=self%unit, file=self%path, status='old', action='read', iostat=io)
        if (io /= 0) error = self%path//': cannot be opened for reading'
    end subroutine open_for_reading

    !> Whether a path leads to the file that is open here, by any name or link; false for a device, such as a
    !> terminal, which may be read and written. '-' is standard output.
    function is_file(self, path) result(same)
        class(number_file), intent(in) :: self
        character(*), intent(in) :: path
        logical :: same
        character(:), allocatable :: name, real_path, own_path
        integer :: unit, io

        name = path
        if (name == '-') name = '/dev/stdout'
        real_path = without_links(name)
        same = .false.
        if (is_special(real_path)) return
        ! Most compilers find an open file by any of its names, some only by the name it was opened with.
        inquire (file=name, number=unit, iostat=io)
        same = io == 0 .and. unit == self%unit
        own_path = without_links(self%path)
        if (len(own_path) > 0) same = same .or. real_path == own_path
    end function is_file

    !> Goes back to the first number. With `by_lines` every item then starts on a new line, as if each were
    !> read by a statement of its own: numbers left on a line are dropped, and `surplus` names the first of
    !> them.
    subroutine start_over(self, by_lines)
        class(number_file), intent(inout) :: self
        logical, intent(in) :: by_lines

        self%by_lines = by_lines
        self%current = 0
        self%position = 1
        self%repeats = 0
        self%comma_may_follow = .false.
    end subroutine start_over

    !> Closes the file.
    subroutine close_file(self)
        class(number_file), intent(inout) :: self
        integer :: io

        if (self%unit /= input_unit) close (self%unit, iostat=io)
    end subroutine close_file

    !> An item of one number.
    subroutine read_number(self, item, value, error)
        class(number_file), intent(inout) :: self
        character(*), intent(in) :: item                    !! its name, for messages
        real(wp), intent(out) :: value                      !! 0 on error
        character(:), allocatable, intent(out) :: error

        call self%begin_item()
        call self%next_number(item, value, error)
        self%last = item
    end subroutine read_number

    !> An item of as many numbers as `values` holds.
    subroutine read_numbers(self, item, values, error)
        class(number_file), intent(inout) :: self
        character(*), intent(in) :: item                    !! common name of the numbers, for messages
        real(wp), intent(out) :: values(:)                  !! 0 from the first error on
        character(:), allocatable, intent(out) :: error
        character(24) :: number
        integer :: i

        values = 0.0_wp
        call self%begin_item()
        do i = 1, size(values)
            write (number, '(a,i0,a)') '(', i, ')'
            call self%next_number(item//trim(number), values(i), error)
            if (allocated(error)) return
        end do
        self%last = item//trim(number)
    end subroutine read_numbers

    !> An error if a number follows the last item: on its line, or on the next line that is not blank. A line
    !> that starts with another word ends the search.
    subroutine expect_end(self, error)
        class(number_file), intent(inout) :: self
        character(:), allocatable, intent(out) :: error
        logical :: found

        call self%begin_item()
        if (self%repeats == 0) then
            call self%find_word(found, error)
            if (allocated(error) .or. .not. found) return
            self%word = self%word_here()
            if (.not. is_value(self%word)) return
        end if
        error = self%complaint('after '//self%last, 'the end of the file', quoted(self%word))
    end subroutine expect_end

    !> The error message: the place, what was expected there, and what was found.
    pure function complaint(self, item, expected, found) result(error)
        class(number_file), intent(in) :: self
        character(*), intent(in) :: item, expected, found
        character(:), allocatable :: error
        character(12) :: number

        write (number, '(i0)') self%line_number
        error = self%path//', line '//trim(number)//': '//item//': expected '//expected//', found '//found
    end function complaint

    !> Finds where the next item starts. If a number follows the last item on its line, the next item starts
    !> with this number, unless `by_lines`. Otherwise the end of the line is skipped.
    subroutine begin_item(self)
        class(number_file), intent(inout) :: self
        logical :: goes_on

        if (self%current == 0) return
        associate (text => self%lines(self%current)%text)
            goes_on = self%repeats > 0
            if (.not. goes_on) then
                do while (self%position <= len(text))
                    if (.not. (is_blank(text(self%position:self%position)) .or. &
                               text(self%position:self%position) == ',')) exit
                    self%position = self%position + 1
                end do
                goes_on = is_value(self%word_here())
                if (goes_on) self%word = self%word_here()
            end if
            if (goes_on .and. .not. self%by_lines) return
            if (goes_on .and. .not. allocated(self%surplus)) then
                self%surplus = self%complaint('after '//self%last, 'the end of the line', quoted(self%word))
            end if
            self%repeats = 0
            self%position = len(text) + 1
            self%comma_may_follow = .false.
        end associate
    end subroutine begin_item

    !> The next number of an item.
    subroutine next_number(self, item, value, error)
        class(number_file), intent(inout) :: self
        character(*), intent(in) :: item
        real(wp), intent(out) :: value                      !! 0 on error
        character(:), allocatable, intent(out) :: error
        character(:), allocatable :: number
        logical :: found
        integer :: io

        value = 0.0_wp
        if (self%repeats == 0) then
            do
                call self%find_word(found, error)
                if (allocated(error)) return
                if (.not. found) then
                    error = self%complaint(item, 'a number', 'the end of the file')
                    return
                end if
                self%word = self%word_here()
                if (len(self%word) > 0) exit
                ! The word is empty in front of a comma.
                if (.not. self%comma_may_follow) then
                    error = self%complaint(item, 'a number', 'nothing before a comma')
                    return
                end if
                self%comma_may_follow = .false.
                self%position = self%position + 1
            end do
            ! A slash ends a list-directed read.
            if (index(self%word, '/') > 1) self%word = self%word(:index(self%word, '/') - 1)
            call split_value(self%word, self%repeats, number)
            io = 0
            if (self%repeats > 0) then
                if (is_too_large(number)) then
                    error = self%complaint(item, 'a number of magnitude at most 1e100', quoted(self%word))
                    return
                end if
                read (number, *, iostat=io) self%value
            end if
            if (self%repeats == 0 .or. io /= 0) then
                error = self%complaint(item, 'a number', quoted(self%word))
                return
            end if
            self%position = self%position + len(self%word)
            self%comma_may_follow = .true.
        end if
        self%repeats = self%repeats - 1
        value = self%value
    end subroutine next_number

    !> Moves to the next character that is not blank, on this line or on a later one.
    subroutine find_word(self, found, error)
        class(number_file), intent(inout) :: self
        logical, intent(out) :: found                       !! false at the end of the file
        character(:), allocatable, intent(out) :: error

        found = .false.
        do
            if (self%current > 0) then
                associate (text => self%lines(self%current)%text)
                    do while (self%position <= len(text))
                        found = .not. is_blank(text(self%position:self%position))
                        if (found) return
                        self%position = self%position + 1
                    end do
                end associate
            end if
            do while (self%current == self%kept)
                self%line_number = self%lines_read
                if (self%at_end) return
                call self%next_line(error)
                if (allocated(error)) return
            end do
            self%current = self%current + 1
            self%position = 1
            self%line_number = self%lines(self%current)%number
        end do
    end subroutine find_word

    !> The word at the place reached, up to a blank or a comma.
    pure function word_here(self) result(word)
        class(number_file), intent(in) :: self
        character(:), allocatable :: word
        integer :: last

        associate (text => self%lines(self%current)%text)
            last = self%position - 1
            do while (last < len(text))
                if (is_blank(text(last + 1:last + 1)) .or. text(last + 1:last + 1) == ',') exit
                last = last + 1
            end do
            word = text(self%position:last)
        end associate
    end function word_here

    !> Reads one more line; sets `at_end` when it is the last.
    subroutine next_line(self, error)
        class(number_file), intent(inout) :: self
        character(:), allocatable, intent(out) :: error
        integer :: io, length, taken

        length = 0
        do
            read (self%unit, '(a)', advance='no', size=taken, iostat=io) &
                self%buffer(length + 1:length + piece)
            self%at_end = is_iostat_end(io)
            if (self%at_end) exit
            if (.not. (io == 0 .or. is_iostat_eor(io))) then
                error = self%path//': cannot be read'
                return
            end if
            length = length + taken
            if (is_iostat_eor(io)) exit
            if (length > longest_line) then
                self%line_number = self%lines_read + 1
                error = self%complaint('line', 'at most 100000 characters', 'more')
                return
            end if
        end do
        if (self%at_end .and. length == 0) return
        self%lines_read = self%lines_read + 1
        call self%keep_line(self%buffer(:length))
    end subroutine next_line

    !> Keeps a line, without its comment, unless it is blank.
    subroutine keep_line(self, line)
        class(number_file), intent(inout) :: self
        character(*), intent(in) :: line
        character(*), parameter :: byte_order_mark = char(239)//char(187)//char(191)
        type(text_line), allocatable :: more(:)
        integer :: first, last

        first = 1
        if (self%lines_read == 1 .and. index(line, byte_order_mark) == 1) first = 1 + len(byte_order_mark)
        last = scan(line, '#!') - 1
        if (last < 0) last = len(line)
        if (verify(line(first:last), ' '//achar(9)//achar(13)) == 0) return
        if (self%kept == size(self%lines)) then
            allocate (more(2*self%kept))
            more(:self%kept) = self%lines
            call move_alloc(more, self%lines)
        end if
        self%kept = self%kept + 1
        self%lines(self%kept)%number = self%lines_read
        self%lines(self%kept)%text = line(first:last)
    end subroutine keep_line

end module frb_number_files
