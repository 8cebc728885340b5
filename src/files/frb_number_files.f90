!> Files of numbers, read one number at a time, every error with its file, line and item.
!>
!> Numbers stand between blanks, tabs or line ends; a comment runs from # or ! to the end of its line.
!> A number is what Fortran and C both write: an optional sign, digits with an optional point, and an
!> optional exponent after E, e, D or d. Errors are values: `error` comes back allocated when something
!> is wrong, as one line of text.
module frb_number_files
    use frb_kinds, only: wp
    implicit none
    private

    public :: number_file, largest_magnitude

    !> Numbers beyond this are refused: squares and products of two of them stay finite.
    real(wp), parameter :: largest_magnitude = 1.0e100_wp

    !> Longest line accepted, so that a file without line ends is refused in time.
    integer, parameter :: longest_line = 100000

    !> A file open for reading, and the place reached in it.
    type :: number_file
        character(:), allocatable :: path           !! as the caller gave it
        integer :: line_number = 0                  !! of the number read last; 0 before the first
        character(:), allocatable, private :: line  !! the current line without its comment
        integer, private :: position = 1            !! where in `line` the next number is looked for
        integer, private :: unit = 0
        logical, private :: at_end = .false.
    contains
        procedure :: open_for_reading
        procedure :: read_number
        procedure :: read_numbers
        procedure :: expect_end
        procedure :: complaint
        procedure :: close_file
        procedure, private :: next_word
        procedure, private :: next_line
    end type number_file

contains

    !> Opens a file for reading.
    subroutine open_for_reading(self, path, error)
        class(number_file), intent(inout) :: self
        character(*), intent(in) :: path                    !! trailing blanks do not count
        character(:), allocatable, intent(out) :: error     !! allocated if it cannot be opened
        integer :: io

        self%path = trim(path)
        self%line = ''
        self%position = 1
        self%line_number = 0
        self%at_end = .false.
        open (newunit=self%unit, file=self%path, status='old', action='read', iostat=io)
        if (io /= 0) error = self%path//': cannot be opened for reading'
    end subroutine open_for_reading

    !> Closes the file.
    subroutine close_file(self)
        class(number_file), intent(inout) :: self
        integer :: io

        close (self%unit, iostat=io)
    end subroutine close_file

    !> The next number of the file.
    subroutine read_number(self, item, value, error)
        class(number_file), intent(inout) :: self
        character(*), intent(in) :: item                    !! its name, for messages
        real(wp), intent(out) :: value                      !! 0 on error
        character(:), allocatable, intent(out) :: error
        character(:), allocatable :: word
        logical :: too_large
        integer :: io

        value = 0.0_wp
        call self%next_word(word, error)
        if (allocated(error)) return
        if (len(word) == 0) then
            error = self%complaint(item, 'a number', 'the end of the file')
        else if (.not. is_number(word)) then
            error = self%complaint(item, 'a number', quoted(word))
        else
            call check_magnitude(word, too_large)
            if (too_large) then
                error = self%complaint(item, 'a number of magnitude at most 1e100', quoted(word))
            else
                read (word, *, iostat=io) value
                if (io /= 0) error = self%complaint(item, 'a number', quoted(word))
            end if
        end if
    end subroutine read_number

    !> The next numbers of the file, as many as `values` holds.
    subroutine read_numbers(self, item, values, error)
        class(number_file), intent(inout) :: self
        character(*), intent(in) :: item                    !! their common name, for messages
        real(wp), intent(out) :: values(:)                  !! 0 from the first error on
        character(:), allocatable, intent(out) :: error
        character(24) :: number
        integer :: i

        values = 0.0_wp
        do i = 1, size(values)
            write (number, '(a,i0,a)') '(', i, ')'
            call self%read_number(item//trim(number), values(i), error)
            if (allocated(error)) return
        end do
    end subroutine read_numbers

    !> Complains unless nothing but blanks and comments is left.
    subroutine expect_end(self, last_item, error)
        class(number_file), intent(inout) :: self
        character(*), intent(in) :: last_item               !! name of the item read last
        character(:), allocatable, intent(out) :: error
        character(:), allocatable :: word

        call self%next_word(word, error)
        if (allocated(error)) return
        if (len(word) > 0) error = self%complaint('after '//last_item, 'the end of the file', quoted(word))
    end subroutine expect_end

    !> One line that says where something is wrong, what was expected there and what was found.
    pure function complaint(self, item, expected, found) result(error)
        class(number_file), intent(in) :: self
        character(*), intent(in) :: item, expected, found
        character(:), allocatable :: error
        character(12) :: number

        write (number, '(i0)') self%line_number
        error = self%path//', line '//trim(number)//': '//item//': expected '//expected//', found '//found
    end function complaint

    !> The next word, on whatever line it is; empty at the end of the file.
    subroutine next_word(self, word, error)
        class(number_file), intent(inout) :: self
        character(:), allocatable, intent(out) :: word
        character(:), allocatable, intent(out) :: error
        integer :: first, last

        do
            first = self%position
            do while (first <= len(self%line))
                if (.not. is_blank(self%line(first:first))) exit
                first = first + 1
            end do
            if (first <= len(self%line)) exit
            if (.not. self%at_end) call self%next_line(error)
            if (self%at_end .or. allocated(error)) then
                word = ''
                return
            end if
        end do
        last = first
        do while (last < len(self%line))
            if (is_blank(self%line(last + 1:last + 1))) exit
            last = last + 1
        end do
        word = self%line(first:last)
        self%position = last + 1
    end subroutine next_word

    !> Reads one more line and drops its comment; sets `at_end` when there is none.
    subroutine next_line(self, error)
        class(number_file), intent(inout) :: self
        character(:), allocatable, intent(out) :: error
        character(:), allocatable :: line, longer
        integer :: io, length, used, comment

        self%line = ''
        self%position = 1
        allocate (character(512) :: line)
        used = 0
        do
            read (self%unit, '(a)', advance='no', size=length, iostat=io) line(used + 1:)
            if (is_iostat_end(io)) then
                self%at_end = .true.
                return
            end if
            if (.not. (io == 0 .or. is_iostat_eor(io))) then
                error = self%path//': cannot be read'
                return
            end if
            used = used + length
            if (is_iostat_eor(io)) exit
            if (used > longest_line) then
                self%line_number = self%line_number + 1
                error = self%complaint('line', 'at most 100000 characters', 'more')
                return
            end if
            ! Doubled, not joined: the part of a line read so far is copied few times, never to the stack.
            allocate (character(2*len(line)) :: longer)
            longer(:used) = line
            call move_alloc(longer, line)
        end do
        self%line_number = self%line_number + 1
        comment = scan(line(:used), '#!')
        if (comment > 0) used = comment - 1
        self%line = line(:used)
    end subroutine next_line

    !> Whether a character separates words: blank, tab, or the carriage return of a foreign line end.
    elemental function is_blank(character) result(blank)
        character, intent(in) :: character
        logical :: blank

        blank = character == ' ' .or. iachar(character) == 9 .or. iachar(character) == 13
    end function is_blank

    !> Whether a word is a number: [sign] digits [. digits] [E|D [sign] digits], a digit before the exponent.
    pure function is_number(word) result(number)
        character(*), intent(in) :: word
        logical :: number
        character(*), parameter :: digits = '0123456789'
        character(:), allocatable :: mantissa, exponent
        integer :: split, point

        number = .false.
        split = scan(word, 'EeDd')
        if (split > 0) then
            mantissa = unsigned(word(:split - 1))
            exponent = unsigned(word(split + 1:))
            if (len(exponent) == 0 .or. verify(exponent, digits) > 0) return
        else
            mantissa = unsigned(word)
        end if
        point = index(mantissa, '.')
        if (point > 0) mantissa = mantissa(:point - 1)//mantissa(point + 1:)
        number = len(mantissa) > 0 .and. verify(mantissa, digits) == 0
    end function is_number

    !> Whether a number is beyond `largest_magnitude`, from its text: converting first would overflow.
    pure subroutine check_magnitude(word, too_large)
        character(*), intent(in) :: word    !! a number
        logical, intent(out) :: too_large
        character(:), allocatable :: mantissa, exponent_text
        integer :: split, point, leading, exponent, io
        integer, parameter :: most_digits = 8

        split = scan(word, 'EeDd')
        if (split == 0) split = len(word) + 1
        mantissa = unsigned(word(:split - 1))
        point = scan(mantissa, '.')
        if (point == 0) point = len(mantissa) + 1
        leading = scan(mantissa, '123456789')
        too_large = .false.
        if (leading == 0) return
        exponent = 0
        if (split < len(word)) then
            exponent_text = unsigned(word(split + 1:))
            exponent_text = exponent_text(max(1, verify(exponent_text//'1', '0')):)
            if (len(exponent_text) > most_digits) then
                exponent = 10**most_digits
            else if (len(exponent_text) > 0) then
                read (exponent_text, *, iostat=io) exponent
            end if
            if (word(split + 1:split + 1) == '-') exponent = -exponent
        end if
        ! Power of ten of the first digit that is not 0.
        exponent = exponent + point - leading
        if (leading < point) exponent = exponent - 1
        too_large = exponent > 100
        if (exponent == 100) then
            mantissa(leading:leading) = char(ichar(mantissa(leading:leading)) - 1)
            too_large = scan(mantissa, '123456789') > 0
        end if
    end subroutine check_magnitude

    !> A word without its sign.
    pure function unsigned(word) result(rest)
        character(*), intent(in) :: word
        character(:), allocatable :: rest

        rest = word
        if (len(word) > 0) then
            if (word(1:1) == '+' .or. word(1:1) == '-') rest = word(2:)
        end if
    end function unsigned

    !> A word in quotes, cut at 40 characters, with ? for what cannot be printed.
    pure function quoted(word) result(text)
        character(*), intent(in) :: word
        character(:), allocatable :: text
        integer, parameter :: longest = 40
        integer :: i

        text = word(:min(len(word), longest))
        do i = 1, len(text)
            if (iachar(text(i:i)) < 32 .or. iachar(text(i:i)) > 126) text(i:i) = '?'
        end do
        if (len(word) > longest) text = text//'...'
        text = "'"//text//"'"
    end function quoted

end module frb_number_files
