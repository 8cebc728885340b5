!> The C interface to runs under torque, described in frb.h: a heavy top, and a torque given as a C function.
module frb_c_torque
    use frb_c_memory, only: find_state, quadruple, triple
    use frb_free_flow, only: rigid_body
    use frb_kinds, only: wp
    use frb_scenes, only: heavy_top
    use frb_schemes, only: splitting_scheme
    use frb_splitting, only: integrate
    use frb_status, only: status_ok, status_bad_option, status_bad_torque
    use frb_torque, only: body_scene
    use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_double, c_f_pointer, c_f_procpointer, &
        c_funptr, c_int, c_int64_t, c_null_char, c_ptr
    implicit none
    private

    public :: torque_in_c

    !> The arguments of a torque in C.
    abstract interface
        !> The user's torque in C.
        function torque_in_c(context, q, t, tau) bind(c) result(stat)
            import :: c_double, c_int, c_ptr
            implicit none
            type(c_ptr), value :: context
            real(c_double), intent(in) :: q(4)
            real(c_double), value :: t
            real(c_double), intent(out) :: tau(3)
            integer(c_int) :: stat
        end function torque_in_c
    end interface

    !> A scene whose torque is a C function.
    type, extends(body_scene) :: c_scene
        procedure(torque_in_c), pointer, nopass :: torque_of => null()
        type(c_ptr) :: context
    contains
        procedure :: torque => torque_of_c_scene    !! calls the C function
    end type c_scene

    !> A name of a scheme in C is read no further than this.
    integer, parameter :: longest_name = 32

contains

    !> Calls the C function.
    subroutine torque_of_c_scene(self, q, t, tau, stat)
        class(c_scene), intent(inout) :: self
        real(wp), intent(in) :: q(4), t
        real(wp), intent(out) :: tau(3)
        integer, intent(out) :: stat

        stat = self%torque_of(self%context, q, t, tau)
    end subroutine torque_of_c_scene

    !> A run under a torque in C.
    function c_integrate(body, scheme, torque, context, h, steps, m, q, t, rests) &
        bind(c, name='frb_integrate') result(stat)
        type(c_ptr), value :: body, scheme, context, m, q, t, rests
        type(c_funptr), value :: torque
        real(c_double), value :: h
        integer(c_int64_t), value :: steps
        integer(c_int) :: stat
        procedure(torque_in_c), pointer :: torque_of
        type(c_scene) :: scene

        stat = status_bad_torque
        if (.not. c_associated(torque)) return
        call c_f_procpointer(torque, torque_of)
        scene%torque_of => torque_of
        scene%context = context
        call run(body, scheme, scene, h, steps, m, q, t, rests, stat)
    end function c_integrate

    !> A run of a heavy top.
    function c_integrate_top(body, scheme, force, centre, h, steps, m, q, t, rests) &
        bind(c, name='frb_integrate_top') result(stat)
        type(c_ptr), value :: body, scheme, force, centre, m, q, t, rests
        real(c_double), value :: h
        integer(c_int64_t), value :: steps
        integer(c_int) :: stat
        type(triple), pointer :: three
        type(heavy_top) :: scene

        stat = status_bad_torque
        if (.not. (c_associated(force) .and. c_associated(centre))) return
        call c_f_pointer(force, three)
        scene%force = three%x
        call c_f_pointer(centre, three)
        scene%centre = three%x
        call run(body, scheme, scene, h, steps, m, q, t, rests, stat)
    end function c_integrate_top

    !> The run of a scene; checks the pointers that both kinds of runs share.
    subroutine run(body, scheme, scene, h, steps, m, q, t, rests, stat)
        type(c_ptr), intent(in) :: body, scheme, m, q, t, rests
        class(body_scene), intent(inout) :: scene
        real(c_double), intent(in) :: h
        integer(c_int64_t), intent(in) :: steps
        integer(c_int), intent(out) :: stat
        type(rigid_body), pointer :: whole_body
        type(triple), pointer :: m3
        type(quadruple), pointer :: q4
        real(c_double), pointer :: time, rest(:)
        real(c_double), target :: no_time
        integer :: code

        call find_state(body, m, q, whole_body, m3, q4, stat)
        if (stat /= status_ok) return
        stat = status_bad_option
        if (.not. c_associated(scheme)) return
        no_time = 0.0_c_double
        time => no_time
        if (c_associated(t)) call c_f_pointer(t, time)
        associate (chosen => splitting_scheme(name_at(scheme)))
            if (c_associated(rests)) then
                call c_f_pointer(rests, rest, [7])
                call integrate(whole_body, chosen, scene, h, steps, m3%x, q4%x, t=time, compensated=.true., &
                               rests=rest, stat=code)
            else
                call integrate(whole_body, chosen, scene, h, steps, m3%x, q4%x, t=time, stat=code)
            end if
        end associate
        stat = int(code, c_int)
    end subroutine run

    !> The text at an address of C, up to its ending null.
    function name_at(address) result(name)
        type(c_ptr), intent(in) :: address
        character(:), allocatable :: name
        character(kind=c_char), pointer :: letters(:)
        integer :: i

        call c_f_pointer(address, letters, [longest_name])
        name = ''
        do i = 1, longest_name
            if (letters(i) == c_null_char) return
            name = name//letters(i)
        end do
    end function name_at

end module frb_c_torque
