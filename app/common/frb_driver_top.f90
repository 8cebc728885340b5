!> The observer of driver_example1: writes and watches every state of the run.
module frb_driver_top
    use frb, only: wp, body_observer, quat_to_matrix
    use frb_driver_command, only: fail_run
    use frb_driver_watch, only: run_watch
    use frb_init_files, only: init_values
    use frb_out_files, only: out_file
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: top_recorder

    !> q counts from the attitude of the init file: Q = Q0 E(q).
    type, extends(body_observer) :: top_recorder
        type(init_values) :: start
        type(out_file) :: out
        type(run_watch) :: watch
    contains
        procedure :: observe => write_record
    end type top_recorder

contains

    !> Watches and writes a state. The time between two calls is the time of a step.
    subroutine write_record(self, step, t, m, q, stop)
        class(top_recorder), intent(inout) :: self
        integer(int64), intent(in) :: step
        real(wp), intent(in) :: t, m(3), q(4)
        logical, intent(inout) :: stop
        character(:), allocatable :: error
        real(wp) :: attitude(3, 3), time

        associate (unused_stop => stop)
        end associate
        if (step > 0) call self%watch%end_step()
        attitude = matmul(self%start%attitude, quat_to_matrix(q))
        call self%watch%note(m, attitude, self%start%moments)
        ! A part of Tfin, so that the last time is Tfin to the last digit; t differs by rounding.
        time = t
        if (step > 0) time = (real(step, wp)/self%start%steps)*self%start%t_final
        call self%out%write_record([m, reshape(attitude, [9]), time], error)
        if (allocated(error)) call fail_run(self%out, error)
        call self%watch%begin_step()
    end subroutine write_record

end module frb_driver_top
