!> The catalogue of methods the charts compare, and the one routine that advances a body by any of them.
module frb_chart_methods
    use frb, only: wp, rigid_body, free_flow, frb_step, quat_step, status_ok, quat_to_matrix, matrix_to_quat
    use frb_dmv, only: dmv_body, new_dmv_body, dmv_steps
    use frb_momentum_frames, only: frame_steps
    use frb_rotation_splitting, only: rotation_steps
    use frb_runge_kutta, only: rk4_steps, dormand_prince
    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
    use, intrinsic :: iso_fortran_env, only: error_unit
    implicit none
    private

    public :: method, catalogue, methods_without, find_method, known, style, escaped, advance, advance_once, &
        constants, new_constants
    public :: family_flow, family_batch, family_momentum, family_matrix, family_paper_q, family_paper_a
    public :: family_dmv, family_rotations, family_rk4, family_dp, family_frames

    integer, parameter :: family_flow = 1           !! free flow, quaternion, one body
    integer, parameter :: family_batch = 2          !! free flow, quaternion, many bodies in one call
    integer, parameter :: family_momentum = 3       !! free flow, momentum only: attitude untouched
    integer, parameter :: family_matrix = 4         !! free flow, attitude matrix
    integer, parameter :: family_paper_q = 5        !! quat_step; option: frame, points: np
    integer, parameter :: family_paper_a = 6        !! frb_step; points: np
    integer, parameter :: family_dmv = 7            !! option: order
    integer, parameter :: family_rotations = 8      !! option: order
    integer, parameter :: family_rk4 = 9
    integer, parameter :: family_dp = 10            !! adaptive; tolerance
    integer, parameter :: family_frames = 11        !! option: 1 theta functions, 2 Hermite quadrature

    type :: method
        character(12) :: key = ''       !! name in the tables
        character(40) :: label = ''     !! name in the pictures
        integer :: family = 0
        integer :: option = 0           !! order or frame
        integer :: points = 0           !! Gauss points of the semi-exact variants, 0: exact
        real(wp) :: tolerance = 0.0_wp  !! of the adaptive method
        logical :: exact = .false.      !! one step takes any h
        integer :: colour = 1           !! line type of the pictures
        integer :: dash = 1
        integer :: symbol = 7
        integer :: width = 2
    end type method

    !> The constants that the free flow and the discrete Moser-Veselov method form once per body.
    type :: constants
        type(rigid_body) :: body
        type(dmv_body) :: rival
    end type constants

contains

    !> The constants of the body with the given moments.
    pure function new_constants(moments) result(ready)
        real(wp), intent(in) :: moments(3)
        type(constants) :: ready

        ready%body = rigid_body(moments)
        ready%rival = new_dmv_body(moments)
    end function new_constants

    !> Every method, in the order of the tables.
    function catalogue() result(methods)
        type(method), allocatable :: methods(:)
        character(4) :: digits
        integer, parameter :: gauss(*) = [1, 2, 3, 5, 10]
        integer :: i

        ! Colours: the free flow vermilion, the paper's exact steps green, its semi-exact ones purple,
        ! discrete Moser-Veselov blue, rotations orange, Runge-Kutta black and grey; dash and symbol tell
        ! methods of one colour apart.
        allocate (methods(0))
        call add('flow', 'free flow', family_flow, 0, 0, 2, 1, 7, 4)
        call add('flow-batch', 'free flow, batch', family_batch, 0, 0, 2, 2, 5, 3)
        call add('flow-m', 'free flow, momentum only', family_momentum, 0, 0, 2, 3, 9, 2)
        call add('flow-a', 'free flow, matrix', family_matrix, 0, 0, 2, 4, 11, 2)
        call add('quat_step', 'quat_step', family_paper_q, 1, 0, 4, 1, 9, 2)
        call add('quat_step-f2', 'quat_step, frame 2', family_paper_q, 2, 0, 4, 2, 11, 2)
        call add('quat_step-f3', 'quat_step, frame 3', family_paper_q, 3, 0, 4, 3, 13, 2)
        call add('frb_step', 'frb_step', family_paper_a, 0, 0, 4, 4, 5, 2)
        do i = 1, size(gauss)
            write (digits, '(i0)') gauss(i)
            call add('quat_step-'//digits, 'quat_step, np = '//digits, family_paper_q, 1, gauss(i), 5, &
                     merge(1, 2, gauss(i) > 2), i + 1, 2)
        end do
        do i = 1, size(gauss)
            write (digits, '(i0)') gauss(i)
            call add('frb_step-'//digits, 'frb_step, np = '//digits, family_paper_a, 0, gauss(i), 5, 3, &
                i + 1, 2)
        end do
        call add('theta', 'theta functions', family_frames, 1, 0, 6, 3, 9, 2)
        call add('hermite', 'Hermite quadrature', family_frames, 2, 0, 6, 4, 13, 2)
        do i = 2, 10, 2
            write (digits, '(i0)') i
            call add('dmv'//digits, 'Moser-Veselov '//digits, family_dmv, i, 0, &
                     merge(3, 7, i == 2 .or. i == 10), merge(1, 2, i > 4), i/2 + 7, 2)
        end do
        call add('rotations2', '3 rotations, order 2', family_rotations, 2, 0, 6, 1, 4, 2)
        call add('rotations4', '3 rotations, order 4', family_rotations, 4, 0, 6, 2, 5, 2)
        call add('rk4', 'Runge-Kutta 4', family_rk4, 0, 0, 1, 2, 2, 2)
        do i = 3, 15, 3
            write (digits, '(i0)') i
            call add('dp-'//digits, 'DoPri 8(5,3) 1e-'//digits, family_dp, 0, 0, 8, 1 + i/6, 1, 2, &
                10.0_wp**(-i))
        end do

    contains

        subroutine add(key, label, family, option, points, colour, dash, symbol, width, tolerance)
            character(*), intent(in) :: key, label
            integer, intent(in) :: family, option, points, colour, dash, symbol, width
            real(wp), intent(in), optional :: tolerance
            type(method) :: item
            type(method), allocatable :: longer(:)

            item%key = key
            item%label = label
            item%family = family
            item%option = option
            item%points = points
            if (present(tolerance)) item%tolerance = tolerance
            item%exact = (family <= family_paper_a .and. points == 0) .or. key == 'theta'
            item%colour = colour
            item%dash = dash
            item%symbol = symbol
            item%width = width
            allocate (longer(size(methods) + 1))
            longer(:size(methods)) = methods
            longer(size(longer)) = item
            call move_alloc(longer, methods)
        end subroutine add

    end function catalogue

    !> The catalogue without some families. Of the adaptive method, only the tolerances with these keys.
    function methods_without(families, adaptive_keys) result(kept)
        integer, intent(in) :: families(:)
        character(*), intent(in) :: adaptive_keys(:)
        type(method), allocatable :: kept(:)
        type(method), allocatable :: methods(:)
        logical, allocatable :: keep(:)
        integer :: i

        allocate (methods, source=catalogue())
        allocate (keep(size(methods)))
        do i = 1, size(methods)
            keep(i) = all(methods(i)%family /= families)
            if (methods(i)%family == family_dp) keep(i) = any(methods(i)%key == adaptive_keys)
        end do
        allocate (kept, source=pack(methods, keep))
    end function methods_without

    !> The method of the catalogue with this key; stops when there is none.
    function find_method(key) result(found)
        character(*), intent(in) :: key
        type(method) :: found
        type(method), allocatable :: methods(:)
        integer :: i

        allocate (methods, source=catalogue())
        do i = 1, size(methods)
            if (methods(i)%key == key) then
                found = methods(i)
                return
            end if
        end do
        write (error_unit, '(a)') 'frb_charts: no such method: '//key
        error stop 1
    end function find_method

    !> Whether the catalogue has a method with this key.
    function known(key) result(there)
        character(*), intent(in) :: key
        logical :: there
        type(method), allocatable :: methods(:)

        allocate (methods, source=catalogue())
        there = any(methods%key == key)
    end function known

    !> The end of a gnuplot plot clause: line, symbol and title of a method's curve.
    function style(with, label) result(clause)
        type(method), intent(in) :: with
        character(*), intent(in), &
            optional :: label     !! instead of the method's own; '' for no entry in the key
        character(:), allocatable :: clause
        character(80) :: text

        write (text, '(4(a,i0),a)') ' with linespoints lt ', with%colour, ' dt ', with%dash, ' pt ', &
            with%symbol, ' lw ', with%width, ' ps 0.7'
        if (present(label)) then
            clause = trim(text)//' title "'//label//'"'
        else
            clause = trim(text)//' title "'//escaped(with%label)//'"'
        end if
    end function style

    !> Text for gnuplot, which takes an underscore for the start of a subscript.
    pure function escaped(text) result(safe)
        character(*), intent(in) :: text
        character(:), allocatable :: safe
        integer :: i

        safe = ''
        do i = 1, len_trim(text)
            ! Two backslashes: one is taken by gnuplot's double quotes.
            if (text(i:i) == '_') safe = safe//'\\'
            safe = safe//text(i:i)
        end do
    end function escaped

    !> Takes `nsteps` steps of h; body constants are set up once. NaN when the method refuses.
    !> The batch form advances as many copies of the body as there are columns in a small block and returns
    !> the last; the adaptive method takes as many of its own steps as each h needs.
    subroutine advance(with, moments, h, nsteps, m, q, a, ready)
        type(method), intent(in) :: with
        real(wp), intent(in) :: moments(3)      !! I1, I2, I3
        real(wp), intent(in) :: h               !! step
        integer, intent(in) :: nsteps           !! number of steps
        real(wp), intent(inout) :: m(3)         !! body angular momentum
        real(wp), intent(inout) :: q(4)         !! attitude, body to space
        real(wp), intent(out), optional :: a(3, 3)  !! attitude matrix as the method left it, if it has one
        type(constants), intent(in), optional :: ready  !! of the body, formed here when absent
        type(constants), allocatable :: own     ! allocatable: setting default values takes longer than a step
        real(wp) :: matrix(3, 3)
        integer :: stat

        if (present(ready)) then
            call advance_ready(with, ready, moments, h, nsteps, m, q, matrix, stat)
        else
            allocate (own, source=new_constants(moments))
            call advance_ready(with, own, moments, h, nsteps, m, q, matrix, stat)
        end if
        if (stat /= status_ok) then
            m = ieee_value(m, ieee_quiet_nan)
            q = ieee_value(q, ieee_quiet_nan)
            matrix = ieee_value(matrix, ieee_quiet_nan)
        end if
        if (present(a)) a = matrix
    end subroutine advance

    !> The steps themselves.
    subroutine advance_ready(with, ready, moments, h, nsteps, m, q, matrix, stat)
        type(method), intent(in) :: with
        type(constants), intent(in) :: ready
        real(wp), intent(in) :: moments(3), h
        integer, intent(in) :: nsteps
        real(wp), intent(inout) :: m(3), q(4)
        real(wp), intent(out) :: matrix(3, 3)
        integer, intent(out) :: stat
        integer, parameter :: copies = 8
        real(wp) :: many_m(3, copies), many_q(4, copies)
        integer :: i

        stat = status_ok
        matrix = 0.0_wp
        select case (with%family)
        case (family_flow)
            do i = 1, nsteps
                call free_flow(ready%body, h, m, q, stat)
                if (stat /= status_ok) exit
            end do
        case (family_momentum)
            do i = 1, nsteps
                call free_flow(ready%body, h, m, stat)
                if (stat /= status_ok) exit
            end do
        case (family_batch)
            many_m = spread(m, 2, copies)
            many_q = spread(q, 2, copies)
            do i = 1, nsteps
                call free_flow(ready%body, h, many_m, many_q, stat)
                if (stat /= status_ok) exit
            end do
            m = many_m(:, copies)
            q = many_q(:, copies)
        case (family_matrix)
            matrix = quat_to_matrix(q)
            do i = 1, nsteps
                call free_flow(ready%body, h, m, matrix, stat)
                if (stat /= status_ok) exit
            end do
            q = matrix_to_quat(matrix)
        case (family_paper_q)
            do i = 1, nsteps
                call quat_step(m, q, h, moments, m, q, with%points, with%option, stat)
                if (stat /= status_ok) exit
            end do
        case (family_paper_a)
            matrix = quat_to_matrix(q)
            do i = 1, nsteps
                call frb_step(m, matrix, h, moments, m, matrix, with%points, stat)
                if (stat /= status_ok) exit
            end do
            q = matrix_to_quat(matrix)
        case (family_dmv)
            call dmv_steps(ready%rival, with%option, h, nsteps, m, q)
        case (family_rotations)
            call rotation_steps(moments, with%option, h, nsteps, m, q)
        case (family_frames)
            call frame_steps(moments, with%option == 1, h, nsteps, m, q)
        case (family_rk4)
            call rk4_steps(moments, h, nsteps, m, q)
        case (family_dp)
            if (nsteps == 1) then
                call dormand_prince(moments, h, with%tolerance, m, q)
            else
                do i = 1, nsteps
                    call dormand_prince(moments, h, with%tolerance, m, q, first_step=abs(h))
                end do
            end if
        case default
            stat = -1
        end select
    end subroutine advance_ready

    !> One step of an exact method, for a drift in a splitting.
    subroutine advance_once(with, moments, h, m, q, stat)
        type(method), intent(in) :: with
        real(wp), intent(in) :: moments(3), h
        real(wp), intent(inout) :: m(3), q(4)
        integer, intent(out) :: stat

        stat = status_ok
        call advance(with, moments, h, 1, m, q)
    end subroutine advance_once

end module frb_chart_methods
