!> Words of a file of numbers, by the rules of Fortran's list-directed input: one number, or a count, a star
!> and a number, which stands for that many equal numbers.
module frb_number_words
    implicit none
    private

    public :: is_blank, is_value, split_value, is_too_large, quoted

    character(*), parameter :: digits = '0123456789'

contains

    !> Whether a character separates words: blank, tab, or the carriage return of a foreign line end.
    elemental function is_blank(character) result(blank)
        character, intent(in) :: character
        logical :: blank

        blank = character == ' ' .or. iachar(character) == 9 .or. iachar(character) == 13
    end function is_blank

    !> Whether a word stands for one or more numbers.
    pure function is_value(word) result(value)
        character(*), intent(in) :: word
        logical :: value
        character(:), allocatable :: number
        integer :: count

        call split_value(word, count, number)
        value = count > 0
    end function is_value

    !> The number in a word, with its exponent after an E, and its count; the count is 0 if the word is no
    !> number.
    pure subroutine split_value(word, count, number)
        character(*), intent(in) :: word
        integer, intent(out) :: count
        character(:), allocatable, intent(out) :: number
        integer, parameter :: most_digits = 9
        character(:), allocatable :: mantissa, exponent
        integer :: star, split, point, io

        count = 0
        star = index(word, '*')
        number = word(star + 1:)
        split = scan(number, 'EeDdQq')
        if (split > 0) then
            exponent = number(split + 1:)
        else
            split = scan(number(min(2, len(number) + 1):), '+-') + 1
            if (split == 1) split = len(number) + 1
            exponent = number(split:)
            if (len(exponent) == 0) exponent = '0'
        end if
        number = number(:split - 1)
        mantissa = unsigned(number)
        point = index(mantissa, '.')
        if (point > 0) mantissa = mantissa(:point - 1)//mantissa(point + 1:)
        if (len(mantissa) == 0 .or. verify(mantissa, digits) > 0) return
        if (len(unsigned(exponent)) == 0 .or. verify(unsigned(exponent), digits) > 0) return
        number = number//'E'//exponent
        if (star == 0) then
            count = 1
        else if (star > 1 .and. star <= most_digits .and. verify(word(:star - 1), digits) == 0) then
            read (word(:star - 1), *, iostat=io) count
        end if
    end subroutine split_value

    !> Whether a number is beyond 1e100, found in its text: a conversion could overflow.
    pure function is_too_large(number) result(too_large)
        character(*), intent(in) :: number  !! with its exponent after an E
        logical :: too_large
        character(:), allocatable :: mantissa, exponent_text
        integer :: split, point, leading, exponent, io
        integer, parameter :: most_digits = 8

        split = index(number, 'E')
        mantissa = unsigned(number(:split - 1))
        point = scan(mantissa, '.')
        if (point == 0) point = len(mantissa) + 1
        leading = scan(mantissa, '123456789')
        too_large = .false.
        if (leading == 0) return
        exponent = 0
        exponent_text = unsigned(number(split + 1:))
        exponent_text = exponent_text(verify(exponent_text//'1', '0'):)
        if (len(exponent_text) > most_digits) then
            exponent = 10**most_digits
        else if (len(exponent_text) > 0) then
            read (exponent_text, *, iostat=io) exponent
        end if
        if (number(split + 1:split + 1) == '-') exponent = -exponent
        ! The power of ten of the first digit that is not 0.
        exponent = exponent + point - leading
        if (leading < point) exponent = exponent - 1
        too_large = exponent > 100
        if (exponent == 100) then
            mantissa(leading:leading) = char(ichar(mantissa(leading:leading)) - 1)
            too_large = scan(mantissa, '123456789') > 0
        end if
    end function is_too_large

    !> A word without its sign.
    pure function unsigned(word) result(without)
        character(*), intent(in) :: word
        character(:), allocatable :: without

        without = word
        if (len(word) > 0) then
            if (word(1:1) == '+' .or. word(1:1) == '-') without = word(2:)
        end if
    end function unsigned

    !> A word in quotes, at most 40 characters of it, with ? for each character that cannot be printed.
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

end module frb_number_words
