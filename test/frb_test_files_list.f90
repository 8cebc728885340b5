!> Init files as list-directed input: files that the published programs read are read with the same values.
module frb_test_files_list
    use frb_checks, only: tally
    use frb_file_cases, only: identity, nl, path, says, write_text
    use frb_init_files, only: init_values, read_init_file
    use frb_kinds, only: wp
    implicit none
    private

    public :: test_files_list

    !> State of the random numbers.
    type :: chance
        integer :: state = 12345
    contains
        procedure :: pick
    end type chance

contains

    subroutine test_files_list(t)
        type(tally), intent(inout) :: t

        call test_by_hand(t)
        call test_refused(t)
        call test_surplus(t)
        call test_against_reads(t)
    end subroutine test_files_list

    !> Single features of list-directed input.
    subroutine test_by_hand(t)
        type(tally), intent(inout) :: t
        character(*), parameter :: moments = '1.0, 1.65, 1.972', after = nl//'1 3*0.0'//nl
        type(init_values) :: values
        character(:), allocatable :: error

        call t%open_suite('files-list', 18)
        call write_text('0.1'//nl//moments//nl//'.1 ,.2'//nl//' ,.3, and more'//after)
        call read_init_file(path, 2, values, error)
        call t%ok('commas-and-repeat-counts-are-read', .not. allocated(error))
        call t%close_to('commas-separate', [values%moments, values%m], &
                        [1.0_wp, 1.65_wp, 1.972_wp, 0.1_wp, 0.2_wp, 0.3_wp], 0.0_wp)
        call t%close_to('a-repeat-count-stands-for-its-numbers', values%q, &
                        [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], 0.0_wp)
        call write_text('0.1 s, the step'//nl//'1 2 3/ kg m2, 7 of them'//nl//'3*.5, per 1/s'//nl// &
                        '1,0,0,0 = 1'//nl//'end of the data 5'//nl//'7')
        call read_init_file(path, 2, values, error)
        call t%ok('words-behind-the-numbers-are-passed-over', .not. allocated(error))
        call t%close_to('words-change-no-number', [values%h, values%moments, values%m, values%q(1)], &
                        [0.1_wp, 1.0_wp, 2.0_wp, 3.0_wp, 0.5_wp, 0.5_wp, 0.5_wp, 1.0_wp], 0.0_wp)
        call write_text('1'//nl//'1 1 1'//nl//'1 1 1'//nl//'2*0,'//nl//',1'//nl//'0')
        call read_init_file(path, 2, values, error)
        call t%ok('two-commas-around-a-line-end-are-two', &
                  says(error, 'q(3): expected a number, found nothing'))
        call write_text('1'//nl//'1 1 1'//nl//'1 1 1'//nl//'2*0'//nl//',1'//nl//'0,,,')
        call read_init_file(path, 2, values, error)
        call t%ok('a-comma-at-a-line-start-is-one-separator', .not. allocated(error))
        call t%close_to('numbers-around-line-ends-are-in-place', values%q, &
                        [0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp], 0.0_wp)
        call write_text('1 3*2 3*0'//nl//'4*.5')
        call read_init_file(path, 2, values, error)
        call t%ok('items-may-share-a-line-with-repeat-counts', .not. allocated(error))
        call t%close_to('a-repeat-count-ends-with-its-item', [values%h, values%moments, values%m], &
                        [1.0_wp, 2.0_wp, 2.0_wp, 2.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], 0.0_wp)
        call write_text('6*1 0 1 3*0')
        call read_init_file(path, 2, values, error)
        call t%close_to('a-repeat-count-may-span-items', [values%h, values%moments, values%m], &
                        [1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp, 0.0_wp], 0.0_wp)
        call write_text('6*1 0 1 4*0')
        call read_init_file(path, 2, values, error)
        call t%ok('a-repeat-count-that-spans-items-is-counted', &
                  says(error, "line 1: after q(4): expected the end of the file, found '4*0'"))
        call write_text('1+2 1.5q0 25Q-1 3.E0 2D-1 2.-1 +.2 1 3*0')
        call read_init_file(path, 2, values, error)
        call t%close_to('every-exponent-is-read', [values%h, values%moments, values%m], &
                        [100.0_wp, 1.5_wp, 2.5_wp, 3.0_wp, 0.2_wp, 0.2_wp, 0.2_wp], 0.0_wp)
        ! Read item after item, 7 is q(1) and the slash ends the file; read by lines, 7 is dropped.
        call write_text('1'//nl//'1 1 1'//nl//'1 1 1, 7'//nl//'1 0 0 0/ no more')
        call read_init_file(path, 2, values, error)
        call t%ok('a-surplus-number-that-a-slash-makes-up-for-is-told', &
                  says(error, "line 3: after m(3): expected the end of the line, found '7'"))
        call write_text('1'//nl//'1 1 1'//nl//'1 1 1 1/s'//nl//'1 0 0 0/ no more')
        call read_init_file(path, 2, values, error)
        call t%ok('a-unit-with-a-slash-is-no-number', .not. allocated(error))
        call write_text(char(239)//char(187)//char(191)//'0.5'//nl//'1 1 1'//nl//'1 1 1'//nl//'1 0 0 0')
        call read_init_file(path, 2, values, error)
        call t%ok('a-byte-order-mark-is-skipped', .not. allocated(error))
        call write_text('1'//nl//'1 1 1'//nl//'1 1 1'//nl//'1 0 0'//repeat(' ', 506)//'0')
        call read_init_file(path, 2, values, error)
        call t%ok('a-last-line-of-512-characters-is-read', .not. allocated(error))
        call write_text('1'//nl//'1 1 1'//nl//repeat(' ', 90000)//'1 1 1'//nl//'1 0 0 0')
        call read_init_file(path, 2, values, error)
        call t%ok('a-long-line-is-read', .not. allocated(error))
        call t%close_suite()
    end subroutine test_by_hand

    !> Input that a list-directed read accepts but leaves unset, and input that it does not accept.
    subroutine test_refused(t)
        type(tally), intent(inout) :: t

        call t%open_suite('files-list-refused', 8)
        call refuse('nothing-between-commas-is-refused', '1'//nl//'1,,3', &
                    'line 2: I(2): expected a number, found nothing before a comma')
        call refuse('nothing-before-a-comma-is-refused', '1'//nl//',1 2 3', &
                    'line 2: I(1): expected a number, found nothing before a comma')
        call refuse('an-early-slash-is-refused', '1'//nl//'1 2/ 3', &
                    "line 2: I(3): expected a number, found '/'")
        call refuse('a-repeat-count-of-nothing-is-refused', '1'//nl//'2* 3', &
                    "line 2: I(1): expected a number, found '2*'")
        call refuse('a-word-before-the-numbers-is-refused', 'h = 1', &
                    "line 1: h: expected a number, found 'h'")
        call refuse('a-word-among-the-numbers-is-refused', '1'//nl//'1 2 kg 3', &
                    "line 2: I(3): expected a number, found 'kg'")
        call refuse('a-number-with-its-unit-is-refused', '1s', &
                    "line 1: h: expected a number, found '1s'")
        call refuse('a-repeated-number-too-large-is-refused', '1'//nl//'3*1e101', &
                    'of magnitude at most 1e100')
        call t%close_suite()

    contains

        !> A file with this content is refused with a message that contains `part`.
        subroutine refuse(name, content, part)
            character(*), intent(in) :: name, content, part
            type(init_values) :: values
            character(:), allocatable :: error

            call write_text(content)
            call read_init_file(path, 0, values, error)
            call t%ok(name, says(error, part))
        end subroutine refuse

    end subroutine test_refused

    !> A number too many on the line of an item, in every item of every example: the error names that line.
    subroutine test_surplus(t)
        type(tally), intent(inout) :: t
        character(*), parameter :: lines(8) = [character(5) :: '0.1', '10', '1 2 3', '1 0 0', '0 1 0', &
            '0 0 1', '1 1 1', '0']
        character(*), parameter :: items(8) = [character(4) :: 'h', 'Tfin', 'm(3)', '', '', 'Q(9)', &
            'I(3)', 'np']
        character(:), allocatable :: text, error
        character(80) :: place
        type(init_values) :: values
        logical :: told
        integer :: at, i

        call t%open_suite('files-surplus', 4)
        told = .true.
        do at = 1, 8
            if (len_trim(items(at)) == 0) cycle
            text = '# title'//nl//nl
            do i = 1, 8
                text = text//trim(lines(i))
                if (i == at) text = text//', 2*9 units'
                text = text//nl
            end do
            write (place, '(a,i0,a)') 'line ', at + 2, ': after '//trim(items(at))// &
                ": expected the end of the line, found '2*9'"
            call write_text(text)
            call read_init_file(path, 3, values, error)
            if (.not. says(error, trim(place))) told = .false.
        end do
        call t%ok('a-surplus-number-is-told-on-its-line', told)
        call write_text('1'//nl//'5*2'//nl//'3*0'//nl//identity)
        call read_init_file(path, 0, values, error)
        call t%ok('a-repeat-count-too-large-is-told', &
                  says(error, "line 2: after I(3): expected the end of the line, found '5*2'"))
        call write_text('1 2'//nl//'1 x'//nl//identity)
        call read_init_file(path, 0, values, error)
        call t%ok('an-error-comes-before-a-surplus', &
                  says(error, "line 2: I(3): expected a number, found 'x'"))
        call write_text('1'//nl//'1 1 1'//nl//'1 1 1'//nl//'1 0 0 0'//nl//nl//'! more'//nl//'2 more')
        call read_init_file(path, 2, values, error)
        call t%ok('a-number-on-a-later-line-is-told', &
                  says(error, "line 7: after q(4): expected the end of the file, found '2'"))
        call t%close_suite()
    end subroutine test_surplus

    !> Random files in all the ways list-directed input allows: read item by item with `read (unit, *)`, as
    !> the published programs do, and here. Same values, to the last bit.
    subroutine test_against_reads(t)
        type(tally), intent(inout) :: t
        integer, parameter :: files = 2000
        real(wp), parameter :: axes(9) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
                                          1.0_wp]
        type(chance) :: dice
        type(init_values) :: values
        character(:), allocatable :: text, error
        real(wp) :: h, t_final, m(3), flat(9), moments(3), a(8), b(7), u0(3)
        integer :: i, unit, io, refused, different

        call t%open_suite('files-list-against-reads', 2)
        refused = 0
        different = 0
        do i = 1, files
            a = [0.125_wp, -0.0625_wp, 0.5_wp, 0.125_wp, 0.125_wp, 0.0_wp, 0.0_wp, -0.625_wp]
            b = [0.25_wp, 0.25_wp, 0.25_wp, -0.125_wp, -0.125_wp, 0.0_wp, 0.0_wp]
            text = item_text(dice, a)//item_text(dice, b)//item_text(dice, [0.01_wp*(1 + dice%pick(9))])// &
                item_text(dice, [7.5_wp])//item_text(dice, [-1.5e-3_wp, 12.25_wp, dice%pick(3)/7.0_wp])
            text = text//item_text(dice, axes)//item_text(dice, [1.0_wp, 1.0_wp + dice%pick(2), 2.5_wp])
            text = text//item_text(dice, [0.5_wp, 0.5_wp, 0.5_wp])
            call write_text(text)
            open (newunit=unit, file=path, status='old', action='read')
            read (unit, *, iostat=io) a
            if (io == 0) read (unit, *, iostat=io) b
            if (io == 0) read (unit, *, iostat=io) h
            if (io == 0) read (unit, *, iostat=io) t_final
            if (io == 0) read (unit, *, iostat=io) m
            if (io == 0) read (unit, *, iostat=io) flat
            if (io == 0) read (unit, *, iostat=io) moments
            if (io == 0) read (unit, *, iostat=io) u0
            close (unit)
            call read_init_file(path, 1, values, error)
            if (allocated(error) .or. io /= 0) then
                refused = refused + 1
                if (refused == 1 .and. allocated(error)) print '(a)', '    got: '//error, text
            else if (any(abs([values%a - a, values%b - b, values%m - m, values%moments - moments, &
                              values%u0 - u0, reshape(values%attitude, [9]) - flat, &
                              values%t_final - t_final, values%h - t_final/int(t_final/h)]) > 0.0_wp)) then
                different = different + 1
                if (different == 1) print '(a)', text
            end if
        end do
        call t%equal('what-list-directed-reads-accept-is-accepted', refused, 0)
        call t%equal('what-is-read-is-what-list-directed-reads-give', different, 0)
        call t%close_suite()
    end subroutine test_against_reads

    !> An item as a user may write it: on lines of its own, with other words behind it.
    function item_text(dice, values) result(text)
        class(chance), intent(inout) :: dice
        real(wp), intent(in) :: values(:)
        character(:), allocatable :: text
        character(*), parameter :: separators(8) = [character(4) :: ' ', ',', ' , ', achar(9), ',  ', '   ', &
            nl//' ', ' ,'//nl]
        integer, parameter :: lengths(8) = [1, 1, 3, 1, 3, 3, 2, 3]
        character(*), parameter :: endings(12) = [character(24) :: '', ' ', ',', ' /', '/ 1 2 3', ' words', &
            ', words 7', ' ! comment', ' # 5', ' = h,,', achar(13), ' 1/s, -- (x) 3*']
        character(32) :: number
        integer :: i, equal, which

        text = ''
        if (dice%pick(4) == 0) text = nl//'   '//nl
        if (dice%pick(3) == 0) text = text//'  '
        i = 1
        do while (i <= size(values))
            equal = 1
            do while (i + equal <= size(values))
                if (abs(values(min(i + equal, size(values))) - values(i)) > 0.0_wp) exit
                equal = equal + 1
            end do
            select case (dice%pick(5))
            case (0)
                write (number, '(es24.16e3)') values(i)
            case (1)
                write (number, '(f20.17)') values(i)
            case (2)
                write (number, '(sp,d24.16)') values(i)
            case (3)
                write (number, '(es24.16e2)') values(i)
                number(scan(number, 'E'):scan(number, 'E')) = merge('q', 'e', dice%pick(2) == 0)
            case default
                write (number, '(g0)') values(i)
            end select
            if (dice%pick(2) == 0) equal = 1
            if (equal > 1) then
                equal = 1 + dice%pick(equal)
                text = text//achar(iachar('0') + equal)//'*'
            end if
            text = text//trim(adjustl(number))
            i = i + equal
            which = 1 + dice%pick(size(separators))
            if (i <= size(values)) text = text//separators(which) (:lengths(which))
        end do
        text = text//trim(endings(1 + dice%pick(size(endings))))//nl
    end function item_text

    !> A random whole number from 0 to below - 1 (Lehmer's generator, on 31 bits by Schrage's division).
    function pick(self, below) result(number)
        class(chance), intent(inout) :: self
        integer, intent(in) :: below
        integer :: number

        self%state = 48271*mod(self%state, 44488) - 3399*(self%state/44488)
        if (self%state <= 0) self%state = self%state + 2147483647
        number = mod(self%state/64, below)
    end function pick

end module frb_test_files_list
