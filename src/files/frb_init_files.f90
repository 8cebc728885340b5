!> The input files of the five driver programs, in the order of the published package.
!>
!> | example | numbers of the file, in this order |
!> |---|---|
!> | 0 | h, I(3), m(3), Q(9) |
!> | 1 | a1..a8, b1..b7, h, Tfin, m(3), Q(9), I(3), u0(3) |
!> | 2 | h, I(3), m(3), q(4) |
!> | 3 | h, Tfin, m(3), Q(9), I(3), np |
!> | 4 | h, Tfin, m(3), q(4), I(3), np |
!>
!> Matrices stand column by column, quaternions scalar first; np = 0 means exact. `frb_number_files` describes
!> how numbers may be written. A file is rejected at its first invalid number.
module frb_init_files
    use frb_kinds, only: wp, most_points
    use frb_number_files, only: number_file
    use frb_rotations, only: cross
    implicit none
    private

    public :: init_values, read_init_file, whole_steps

    !> The contents of an init file; items that the file does not hold keep their defaults.
    type :: init_values
        real(wp) :: a(8) = 0.0_wp           !! coefficients of the free body, up to the centre of the scheme
        real(wp) :: b(7) = 0.0_wp           !! coefficients of the kick, up to the centre
        real(wp) :: h = 0.0_wp              !! step; where the file has Tfin, reset to Tfin/steps
        real(wp) :: t_final = 0.0_wp        !! end of the run, Tfin; h where the file has none
        integer :: steps = 1                !! number of steps from 0 to t_final
        real(wp) :: m(3) = 0.0_wp           !! body angular momentum at the start
        real(wp) :: attitude(3, 3) = 0.0_wp !! attitude matrix at the start, body to space
        real(wp) :: q(4) = 0.0_wp           !! attitude quaternion at the start, of norm one
        real(wp) :: moments(3) = 0.0_wp     !! principal moments of inertia
        real(wp) :: u0(3) = 0.0_wp          !! weight times the direction of gravity, in space
        integer :: points = 0               !! Gauss points, np; 0: exact
    end type init_values

    !> Largest distance of an attitude matrix from orthogonal, and of a sum of coefficients from one: files
    !> with seven digits pass, mistyped digits do not.
    real(wp), parameter :: consistency_tolerance = 1.0e-6_wp

    !> A quotient Tfin/h short of a whole number by this part of itself, and by no more than a hundredth,
    !> counts as whole.
    real(wp), parameter :: quotient_tolerance = 1.0e-8_wp

    !> The items of an example, for messages.
    character(*), parameter :: contents(0:4) = [character(50) :: &
        'h, I(3), m(3), Q(9)', &
        'a1..a8, b1..b7, h, Tfin, m(3), Q(9), I(3), u0(3)', &
        'h, I(3), m(3), q(4)', &
        'h, Tfin, m(3), Q(9), I(3), np', &
        'h, Tfin, m(3), q(4), I(3), np']

    !> Most steps of a run.
    integer, parameter :: most_steps = 2000000000

contains

    !> Reads the init file of an example.
    !>
    !> The published programs read every item from a line of its own and drop further words on the line; here
    !> items may share a line. So a file is read again in the published way. If this succeeds, and the file is
    !> refused or has other values, the error names the first number that was dropped.
    subroutine read_init_file(path, example, values, error, output)
        character(*), intent(in) :: path                    !! -: standard input
        integer, intent(in) :: example                      !! 0 to 4
        type(init_values), intent(out) :: values            !! defaults from the first error on
        character(:), allocatable, intent(out) :: error     !! allocated if the file is refused: one line
        character(*), intent(in), optional :: output        !! refused if it is the init file, by any name
        type(number_file) :: file
        type(init_values) :: by_lines
        character(:), allocatable :: again

        if (example < 0 .or. example > 4) then
            error = trim(path)//': there is no init file of this example'
            return
        end if
        call file%open_for_reading(path, error)
        if (allocated(error)) return
        if (present(output)) then
            if (file%is_file(output)) error = file%path//': is the input, it cannot be the output too'
        end if
        if (.not. allocated(error)) then
            call read_items(file, example, values, error)
            call file%start_over(by_lines=.true.)
            call read_items(file, example, by_lines, again)
            if (allocated(file%surplus) .and. .not. allocated(again)) then
                if (allocated(error) .or. differ(values, by_lines)) error = file%surplus
            end if
            if (allocated(error)) then
                error = error//' (example '//achar(iachar('0') + example)//' has '// &
                        trim(contents(example))//')'
                values = init_values()
            end if
        end if
        call file%close_file()
    end subroutine read_init_file

    !> Whether the contents of two files differ.
    pure function differ(one, other)
        type(init_values), intent(in) :: one, other
        logical :: differ

        differ = any(abs(numbers(one) - numbers(other)) > 0.0_wp)
    end function differ

    !> All contents as numbers.
    pure function numbers(values)
        type(init_values), intent(in) :: values
        real(wp) :: numbers(41)

        numbers = [values%a, values%b, values%h, values%t_final, values%m, reshape(values%attitude, [9]), &
                   values%q, values%moments, values%u0, real([values%steps, values%points], wp)]
    end function numbers

    !> Reads all items of an example; a number after the last item is an error.
    subroutine read_items(file, example, values, error)
        type(number_file), intent(inout) :: file
        integer, intent(in) :: example
        type(init_values), intent(out) :: values
        character(:), allocatable, intent(out) :: error
        ! One letter an item: a and b coefficients, h, T = Tfin, m, Q, q, I = moments, u = u0, n = np.
        character(*), parameter :: layouts(0:4) = ['hImQ    ', 'abhTmQIu', 'hImq    ', 'hTmQIn  ', 'hTmqIn  ']
        integer :: i

        do i = 1, len_trim(layouts(example))
            call read_item(file, layouts(example) (i:i), values, error)
            if (allocated(error)) return
        end do
        if (index(layouts(example), 'T') == 0) values%t_final = values%h
        call file%expect_end(error)
    end subroutine read_items

    !> The number of steps N = int(Tfin/h) of a run to t_final in steps near h, both of one sign; 0 when
    !> there is no such number (h or t_final zero, of different signs, h beyond t_final, more than 2e9
    !> steps). A quotient that is whole up to rounding, 0.3/0.1 = 2.9999999999999996, counts as whole.
    elemental function whole_steps(t_final, h) result(steps)
        real(wp), intent(in) :: t_final     !! end of the run; finite
        real(wp), intent(in) :: h           !! wanted step; finite
        integer :: steps
        real(wp) :: quotient

        steps = 0
        if (.not. (abs(h) > 0.0_wp .and. (t_final > 0.0_wp .eqv. h > 0.0_wp))) return
        ! t_final is divided by the largest count: t_final/h could overflow.
        if (abs(t_final)/most_steps >= abs(h)) return
        quotient = t_final/h
        steps = int(quotient)
        if (steps + 1 - quotient <= min(quotient_tolerance*quotient, 0.01_wp)) steps = steps + 1
    end function whole_steps

    !> Reads one item and checks it.
    subroutine read_item(file, letter, values, error)
        type(number_file), intent(inout) :: file
        character, intent(in) :: letter
        type(init_values), intent(inout) :: values
        character(:), allocatable, intent(out) :: error
        real(wp) :: flat(9), number
        character(12) :: limit

        select case (letter)
        case ('a')
            call file%read_numbers('a', values%a, error)
            if (allocated(error)) return
            call check_sum(file, 'a', 2*sum(values%a(:7)) + values%a(8), '2 (a1 + ... + a7) + a8 = 1', error)
        case ('b')
            call file%read_numbers('b', values%b, error)
            if (allocated(error)) return
            call check_sum(file, 'b', 2*sum(values%b), '2 (b1 + ... + b7) = 1', error)
        case ('h')
            call file%read_number('h', values%h, error)
            if (allocated(error)) return
            if (.not. abs(values%h) > 0.0_wp) error = file%complaint('h', 'a step that is not zero', 'zero')
        case ('T')
            call file%read_number('Tfin', values%t_final, error)
            if (allocated(error)) return
            values%steps = whole_steps(values%t_final, values%h)
            if (values%steps > 0) then
                values%h = values%t_final/values%steps
            else
                error = file%complaint('Tfin', 'Tfin/h to be from 1 to 2e9', &
                                       'Tfin = '//text(values%t_final)//', h = '//text(values%h))
            end if
        case ('m')
            call file%read_numbers('m', values%m, error)
        case ('Q')
            call file%read_numbers('Q', flat, error)
            if (allocated(error)) return
            values%attitude = reshape(flat, [3, 3])
            call check_attitude(file, values%attitude, error)
        case ('q')
            call file%read_numbers('q', values%q, error)
            if (.not. allocated(error)) call normalise(file, values%q, error)
        case ('I')
            call file%read_numbers('I', values%moments, error)
            if (.not. allocated(error)) call check_moments(file, values%moments, error)
        case ('u')
            call file%read_numbers('u0', values%u0, error)
        case ('n')
            call file%read_number('np', number, error)
            if (allocated(error)) return
            if (number < 0.0_wp .or. number > most_points .or. abs(number - aint(number)) > 0.0_wp) then
                write (limit, '(i0)') most_points
                error = file%complaint('np', 'a whole number from 0 to '//trim(limit), text(number))
            else
                values%points = nint(number)
            end if
        case default
            error = file%complaint(letter, 'an item of a layout', 'none')
        end select
    end subroutine read_item

    !> A scheme is consistent if its coefficients sum to one.
    subroutine check_sum(file, item, total, statement, error)
        type(number_file), intent(in) :: file
        character(*), intent(in) :: item, statement
        real(wp), intent(in) :: total
        character(:), allocatable, intent(out) :: error

        if (abs(total - 1) > consistency_tolerance) error = file%complaint(item, statement, text(total))
    end subroutine check_sum

    !> An attitude is orthogonal with determinant +1.
    subroutine check_attitude(file, matrix, error)
        type(number_file), intent(in) :: file
        real(wp), intent(in) :: matrix(3, 3)
        character(:), allocatable, intent(out) :: error
        real(wp) :: defect(3, 3)
        integer :: i

        ! Large entries are refused before the product is formed: it could overflow.
        if (maxval(abs(matrix)) > 2.0_wp) then
            error = file%complaint('Q', 'an orthogonal matrix, column by column', &
                                   'an entry of magnitude '//text(maxval(abs(matrix))))
            return
        end if
        defect = matmul(transpose(matrix), matrix)
        do i = 1, 3
            defect(i, i) = defect(i, i) - 1
        end do
        if (maxval(abs(defect)) > consistency_tolerance) then
            error = file%complaint('Q', 'an orthogonal matrix, column by column', &
                                   'a matrix whose Q^T Q differs from 1 by '//text(maxval(abs(defect))))
            return
        end if
        if (dot_product(matrix(:, 1), cross(matrix(:, 2), matrix(:, 3))) < 0.0_wp) then
            error = file%complaint('Q', 'a rotation', 'a reflection (determinant -1)')
        end if
    end subroutine check_attitude

    !> Scales a quaternion to norm one, unless its norm is one to rounding; zero is an error.
    subroutine normalise(file, q, error)
        type(number_file), intent(in) :: file
        real(wp), intent(inout) :: q(4)
        character(:), allocatable, intent(out) :: error
        real(wp), parameter :: rounding = 4*epsilon(1.0_wp)
        real(wp) :: largest, norm

        largest = maxval(abs(q))
        if (largest < tiny(1.0_wp)) then
            error = file%complaint('q', 'a quaternion that is not zero', 'norm zero')
            return
        end if
        norm = sqrt(sum((q/largest)**2))
        if (abs(norm*largest - 1) > rounding) q = (q/largest)/norm
    end subroutine normalise

    !> Moments are positive, and no smaller than the reciprocal of the largest number read.
    subroutine check_moments(file, moments, error)
        type(number_file), intent(in) :: file
        real(wp), intent(in) :: moments(3)
        character(:), allocatable, intent(out) :: error
        integer :: i

        do i = 1, 3
            if (moments(i) < 1.0e-100_wp) then
                error = file%complaint('I('//achar(iachar('0') + i)//')', 'a positive moment of inertia', &
                                       text(moments(i)))
                return
            end if
        end do
    end subroutine check_moments

    !> A number in few characters.
    pure function text(number)
        real(wp), intent(in) :: number
        character(:), allocatable :: text
        character(16) :: buffer

        write (buffer, '(g0.6)') number
        text = trim(adjustl(buffer))
    end function text

end module frb_init_files
